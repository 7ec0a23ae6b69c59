"""Single changes of the model solutions, made by rule, and what grading makes of them.

General libraries (mutmut, cosmic-ray) change a package's files and run a test command. Here the text to change is the
solution inside a notebook's answer cell, the rules that matter are those of ROS, and the test is the grading of just
the checks that a change can reach; so the rules are the project's own, on Python's `ast`.
"""
