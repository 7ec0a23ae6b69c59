"""Find mistakes in a lab before students receive it: first by reading the lab, then by running it."""
