"""The code that runs in the process tree of a student's programs: the launcher that starts them, and their probe.

Modules in this folder import only the standard library, ROS and each other, and nothing else of the kit, because the
sandbox shows only this folder. They use relative imports, because `launcher.py` loads the folder as a package with a
name that no student's program has.
"""
