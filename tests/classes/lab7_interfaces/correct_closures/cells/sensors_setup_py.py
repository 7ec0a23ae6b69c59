%%file src/car_sensors/setup.py
from pathlib import Path

from setuptools import setup

NAME = "car_sensors"
SHARE = Path("share") / NAME
PROGRAMS = ["speed_sensor", "speed_monitor"]


def files_of(folder):
    """The files of a folder, and where they go."""
    return str(SHARE / folder), sorted(str(p) for p in Path(folder).iterdir() if p.suffix in {".yaml", ".py", ".xml"})


setup(
    name=NAME,
    version="0.1.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (str(SHARE), ["package.xml"]),
        *map(files_of, ("launch", "config")),
    ],
    entry_points={"console_scripts": [f"{p}={NAME}.{p}:main" for p in PROGRAMS]},
)
