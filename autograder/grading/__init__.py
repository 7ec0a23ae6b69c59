"""Run submissions in the sandbox, many at the same time but each in its own sandbox, and store the results."""
