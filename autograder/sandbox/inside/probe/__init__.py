"""Notes what a program does with rclpy, as JSON lines. They are used for hints only, never for points.

A program can forge the notes. The probe runs inside the student's process and must never change what the program does,
or end it. Therefore every note is made in a `quiet` block, the wrapped function is called with unchanged arguments, and
its result or exception is passed on unchanged. The wrappers are installed once, in the launcher; a forked program only
sets where to write. If something cannot be wrapped in a version of rclpy, a `probe_failed` event says so, and then
nothing is concluded from the other events.

There are two kinds of lines. An *event* is something that happens, such as an error in a callback or a wrong return
value. A *record* describes the current state of a thing (a node, an executor, a timer, a call that may block): how
often it ran, on how many threads, since when. A record has a `key` and is written again soon after it has changed. Only
its last line counts. `events.py` defines both kinds, and `autograder/diagnosis/inside.py` reads them.
"""
