"""Notes what a program does with rclpy, as JSON lines: for hints only, never for points; a program can forge them.

It runs inside the student's process and must never change what the program does, or end it. So every note is made in
a `quiet` block, the wrapped function is called with its own arguments, and what it returns or raises goes on as it is.
Wrappers are installed once, in the launcher; a forked program only says where to write. What cannot be wrapped in some
version of rclpy is said by a `probe_failed` event, and then nothing is concluded from what the others say.

There are two kinds of lines. *Events* happen: an error in a callback, a wrong return value. *Records* stand for things
(a node, an executor, a timer, a call that may block) with what has become of them so far: how often, on how many
threads, since when. A record has a `key` and is written again when it has changed, soon but not at once; only its last
line counts. `events.py` defines both; `autograder/diagnosis/inside.py` reads them.
"""
