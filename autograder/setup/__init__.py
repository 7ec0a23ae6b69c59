"""Sets the kit up on a machine, and tells what the machine offers."""
