"""Mutate the model solutions: make single changes by rule, so that checks can be tested with wrong answers.

General libraries (mutmut, cosmic-ray) change the files of a package and run a test command. Here the changed text is
the solution in a notebook's answer cell, the important rules are about ROS, and the test is to grade only the checks
that a change can affect. Therefore the project has its own rules, which use Python's `ast`.
"""
