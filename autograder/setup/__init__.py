"""Set up the kit on a machine, and refuse machines that lack something."""
