"""What runs in the process tree of a student's programs: the launcher that starts them, and the probe inside them.

Everything here imports the standard library, ROS and itself, and nothing else of the kit: the sandbox shows this
folder alone. `launcher.py` loads it as a package under a name that no program of a student's has, so the modules
import each other relatively.
"""
