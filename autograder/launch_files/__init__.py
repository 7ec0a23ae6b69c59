"""Launch files in ROS 2's YAML schema, read without the `launch` packages, because these are on no package index.

A launch file has the same effect here as with `ros2 launch` of Jazzy (launch 3.4, launch_ros 0.26), and everything that
`ros2 launch` refuses is refused here. Features that are not covered are refused, too, with a sentence that says so and
names the place. `schema` lists the actions and keys that are covered, and `substitutions` the substitutions.

The files are written by students. Therefore they are parsed by the loader for students' files, only in the grading
sandbox, and everything that could grow has a limit.
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
