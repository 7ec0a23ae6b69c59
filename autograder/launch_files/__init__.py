"""Launch files: ROS 2's YAML launch schema, read without the `launch` packages (they are on no package index).

What they do here is what `ros2 launch` of Jazzy does with them (launch 3.4, launch_ros 0.26), and what it refuses is
refused here. What is not covered is refused, too, with a sentence that says so and where it stands; `schema` has the
actions and keys that are, `substitutions` the substitutions.

A student wrote the file: it is parsed by the loader for students' files, in the grading sandbox only, and everything
that could grow has a limit.
"""

from autograder.launch_files.errors import INCLUDE_DEPTH, MOST_NODES
from autograder.launch_files.nodes import ForAll, Inline, NodeAction, ParamsFile, ParamsText, remove_written
from autograder.launch_files.reader import declared_arguments, read_launch_file

__all__ = [
    "INCLUDE_DEPTH",
    "MOST_NODES",
    "ForAll",
    "Inline",
    "NodeAction",
    "ParamsFile",
    "ParamsText",
    "declared_arguments",
    "read_launch_file",
    "remove_written",
]
