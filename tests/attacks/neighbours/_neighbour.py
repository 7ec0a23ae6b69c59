"""What the programs beside a notebook share. They are started with the notebook's folder and its user's home."""

import os
import pathlib
import re
import socket
import sys
import tempfile
import time

work, home = map(pathlib.Path, sys.argv[1:])
logs = pathlib.Path(tempfile.gettempdir()) / f"autograder-log-{os.getuid()}"


def ready():
    """Say that the attack has begun."""
    print("ready", flush=True)


def wait():
    """Stay, with all that is open, until the notebook's launch is over."""
    ready()
    time.sleep(600)


def domains():
    """The domains that launches on this machine have claimed."""
    return sorted({int(number) for number in re.findall("@ros-domain-([0-9]+)", read("/proc/net/unix"))})


def groups():
    """The multicast groups in which somebody on this machine listens."""
    found = re.findall("([0-9A-F]{8}):[0-9A-F]{4} 00000000", read("/proc/net/udp"))
    return {name for one in found if (name := socket.inet_ntoa(bytes.fromhex(one)[::-1])).startswith("239.")}


def read(path):
    """Read a file of the system."""
    return pathlib.Path(path).read_text()


def shadow(*names):
    """Lay modules beside the notebook that end whoever imports them."""
    for name in names:
        path = work / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("raise SystemExit('a neighbour was here')\n")


def garbage(addresses):
    """Send what is no message to each port of the domains that are in use."""
    ready()
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    while True:
        for domain in domains():
            for port in (0, 1, 10, 11, 12, 13, 128, 129):
                for address in addresses():
                    out.sendto(b"RTPS" + os.urandom(200), (address, 7400 + 250 * domain + port))
        time.sleep(0.002)


def join(name):
    """Publish in the domains that are in use, with a node of this name and the settings that ROS has by itself."""
    import multiprocessing

    ready()
    joined = {}
    while True:
        for domain in domains():
            if domain not in joined and len(joined) < 6:
                start = multiprocessing.get_context("fork").Process
                joined[domain] = start(target=_publish, args=(name, domain), daemon=True)
                joined[domain].start()
        time.sleep(0.02)


def _publish(name, domain):
    import rclpy
    from std_msgs.msg import String

    context = rclpy.Context()
    context.init(domain_id=domain)
    publisher = rclpy.create_node(name, context=context).create_publisher(String, "/chatter", 10)
    while True:
        publisher.publish(String(data="forged"))
        time.sleep(0.02)
