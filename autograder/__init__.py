"""A ROS 2 course kit that grades itself: it launches students' nodes in a sandbox and watches the ROS graph."""

from autograder.core.version import VERSION

__version__ = VERSION


def load_ipython_extension(shell: object) -> None:
    """Make `%load_ext autograder` register the magics `%%node`, `%%file` and `%ros2`."""
    from autograder.notebook.extension import register

    register(shell)
