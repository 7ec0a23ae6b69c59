"""Says what is wrong with a lab before students meet it: first what can be read, then what running it shows."""
