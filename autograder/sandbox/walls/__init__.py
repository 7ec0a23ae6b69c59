"""The walls between programs: namespaces (bubblewrap), Landlock, and the filter of system calls."""
