%%file src/car_lights/setup.py
from setuptools import setup

setup(
    name="car_lights",
    version="0.1.0",
    packages=["car_lights"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/car_lights"]),
        ("share/car_lights", ["package.xml"]),
        ("share/car_lights/launch", ["launch/lights.launch.yaml"]),
    ],
    entry_points="""
        [console_scripts]
        front_light = car_lights.lights:front
        brake_light = car_lights.lights:brake
    """,
)
