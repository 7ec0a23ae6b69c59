"""What the programs beside a notebook share. They are started with the notebook's folder."""

import pathlib
import re
import sys
import time

work = pathlib.Path(sys.argv[1])


def ready():
    """Say that the attack has begun."""
    print("ready", flush=True)


def wait():
    """Stay, with all that is open, until the notebook's launch is over."""
    ready()
    time.sleep(600)


def domains():
    """The domains that launches on this machine have claimed."""
    return sorted(
        {int(number) for number in re.findall("@ros-domain-([0-9]+)", pathlib.Path("/proc/net/unix").read_text())}
    )


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
