"""The means that isolate programs: namespaces (bubblewrap), Landlock, and the filter of system calls."""
