"""Packages that tests build, and how a submission has them."""

from __future__ import annotations

from collections.abc import Mapping

SENSORS = {
    "package.xml": """<?xml version="1.0"?>
<package format="3">
  <name>NAME</name>
  <version>0.1.0</version>
  <description>Sensors.</description>
  <maintainer email="student@example.org">student</maintainer>
  <license>Apache-2.0</license>
  <exec_depend>rclpy</exec_depend>
  <export><build_type>ament_python</build_type></export>
</package>
""",
    "setup.py": """from setuptools import setup

setup(
    name="NAME",
    version="0.1.0",
    packages=["NAME"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/NAME"]),
        ("share/NAME", ["package.xml"]),
        ("share/NAME/launch", ["launch/car.launch.yaml"]),
    ],
    entry_points={"console_scripts": ["speed_sensor = NAME.sensor:main"]},
)
""",
    "setup.cfg": "[develop]\nscript_dir=$base/lib/NAME\n[install]\ninstall_scripts=$base/lib/NAME\n",
    "resource/NAME": "",
    "launch/car.launch.yaml": "launch:\n- node:\n    pkg: NAME\n    exec: speed_sensor\n    name: front\n",
    "NAME/__init__.py": "",
    "NAME/sensor.py": """import rclpy
from std_msgs.msg import Int64


def main():
    rclpy.init()
    node = rclpy.create_node("sensor")
    publisher = node.create_publisher(Int64, "speed", 10)
    node.create_timer(0.05, lambda: publisher.publish(Int64(data=7)))
    rclpy.spin(node)
""",
}


INTERFACES = {
    "package.xml": """<?xml version="1.0"?>
<package format="3">
  <name>NAME</name>
  <version>0.1.0</version>
  <description>Interfaces.</description>
  <maintainer email="student@example.org">student</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  <depend>std_msgs</depend>
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export><build_type>ament_cmake</build_type></export>
</package>
""",
    "CMakeLists.txt": """cmake_minimum_required(VERSION 3.8)
project(NAME)
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
find_package(std_msgs REQUIRED)
rosidl_generate_interfaces(NAME
  "msg/Thing.msg"
  "msg/Things.msg"
  "srv/Count.srv"
  DEPENDENCIES std_msgs)
ament_package()
""",
    "msg/Thing.msg": "string label\nfloat32 x\n",
    "msg/Things.msg": "std_msgs/Header header\nThing[] things\n",
    "srv/Count.srv": "string label\n---\nint32 count\n",
}


def changed(files: Mapping[str, str], file: str, old: str, new: str) -> dict[str, str]:
    """The files with one thing changed in one of them, which has to be there."""
    assert old in files[file]
    return {**files, file: files[file].replace(old, new)}


def package(name: str, files: Mapping[str, str]) -> dict[str, str]:
    """The files of a package as a submission has them."""
    return {f"src/{name}/{path.replace('NAME', name)}": text.replace("NAME", name) for path, text in files.items()}
