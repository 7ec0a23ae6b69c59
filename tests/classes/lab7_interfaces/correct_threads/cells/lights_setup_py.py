%%file src/car_lights/setup.py
import os
from glob import glob

from setuptools import find_packages, setup

package_name = 'car_lights'

setup(
    name=package_name,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + package_name]),
        ('share/' + package_name, ['package.xml']),
        (os.path.join('share', package_name, 'launch'), glob(os.path.join('launch', '*launch.[pxy][yma]*'))),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='me',
    maintainer_email='me@example.org',
    description='The lights of the car',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [f'{kind}_light = {package_name}.lights:{kind}' for kind in ('front', 'brake')],
    },
)
