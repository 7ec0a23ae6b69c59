"""The sandboxes that isolate a student's programs, and the launcher that starts the programs."""
