%%file src/car_sensors/setup.py
from setuptools import setup

setup(
    name="car_sensors",
    version="0.1.0",
    packages=["car_sensors"], package_dir={"car_sensors": "car_sensors"},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/car_sensors"]),
        ("share/car_sensors", ["package.xml"]),
        ("share/car_sensors/launch", ["launch/sensors.launch.yaml"]),
        ("share/car_sensors/config", ["config/sensors.yaml"]),
    ],
    entry_points={
        "console_scripts": [
            "speed_sensor=car_sensors.speed_sensor:start",
            "speed_monitor = car_sensors.speed_monitor:main",
        ],
    },
)
