"""Concept drawings of lecture 8: the layers of a robot, who brings a part back, and what lies below rclpy."""

from __future__ import annotations

from collections.abc import Callable

from autograder.core.results import Picture
from autograder.pictures.svg import Canvas


def robot_layers() -> Picture:
    """The layers of a mobile robot, with examples, and the way through them."""
    canvas = Canvas(330)
    for number, (layer, nodes, says) in enumerate(
        (
            ("sensors", ("camera", "lidar", "wheels"), "image, scan"),
            ("perception", ("lane", "obstacles"), "lane"),
            ("planning", ("planner", "map"), "path"),
            ("control", ("driver", "motors"), ""),
        )
    ):
        x = 20 + number * 224
        canvas.box(x, 60, 172, 200, round=10, fill="#f6f6f6")
        canvas.words(x + 86, 48, layer, anchor="middle", bold=True)
        for place, node in enumerate(nodes):
            canvas.box(x + 16, 76 + place * 60, 140, 46, look=number, round=8)
            canvas.words(x + 86, 106 + place * 60, node, anchor="middle", halo=True)
        if says:
            canvas.line([(x + 172, 160), (x + 224, 160)], arrow=True, line=2.6)
    canvas.line([(20, 284), (880, 284)], arrow=True, line=2)
    canvas.words(450, 312, "data flows this way, and the layers are brought up in this order", anchor="middle")
    return canvas.picture(
        "Four layers of a robot, from left to right: sensors (camera, lidar, wheels), perception (lane, obstacles), "
        "planning (planner, map), control (driver, motors). Data flows from the sensors to control, and the layers "
        "are brought up in this order."
    )


def two_helpers() -> Picture:
    """What brings a process back, and what brings a node back."""
    canvas = Canvas(352)
    for y, head, knows, sees, does in (
        (20, "launch: respawn", "knows processes", "“the process has ended”", "starts the process again"),
        (180, "manager", "knows states of nodes", "“it is unconfigured”", "configures and activates it"),
    ):
        canvas.box(20, y, 250, 120, round=12, line=2.2)
        canvas.words(145, y + 52, head, anchor="middle", bold=True)
        canvas.words(145, y + 84, knows, anchor="middle")
        canvas.box(610, y, 270, 120, look=0 if y < 100 else 2, round=12)
        canvas.words(745, y + 52, "process" if y < 100 else "node", anchor="middle", bold=True, halo=True)
        canvas.words(745, y + 84, "runs, or not" if y < 100 else "active, or not", anchor="middle", halo=True)
        canvas.line([(608, y + 36), (274, y + 36)], arrow=True)
        canvas.words(440, y + 26, sees, anchor="middle")
        canvas.line([(272, y + 86), (606, y + 86)], arrow=True, line=2.6)
        canvas.words(440, y + 110, does, anchor="middle")
    canvas.words(450, 338, "After a crash both are needed, the upper one first.", anchor="middle", bold=True)
    return canvas.picture(
        "Two helpers. A launch file with respawn knows processes: it sees that a process has ended, and starts it "
        "again. A manager knows the states of nodes: it sees that a node is unconfigured, and configures and "
        "activates it. After a crash both are needed, respawn first."
    )


def middleware() -> Picture:
    """The layers below rclpy in two processes, and the network between them."""
    canvas = Canvas(372)
    layers = (("your node", 1), ("rclpy", None), ("rcl", None), ("rmw", None), ("Fast DDS", 0))
    for x, process in ((40, "process of the camera"), (580, "process of the driver")):
        canvas.words(x + 140, 30, process, anchor="middle", bold=True)
        for number, (name, look) in enumerate(layers):
            canvas.box(x, 46 + number * 46, 280, 42, look=look, round=6)
            canvas.words(x + 140, 74 + number * 46, name, anchor="middle", halo=True)
    canvas.words(450, 82, "1  “I am here”", anchor="middle", bold=True)
    canvas.words(450, 106, "to all who listen", anchor="middle")
    canvas.words(450, 146, "2  “I publish image”", anchor="middle", bold=True)
    canvas.words(450, 170, "to each other", anchor="middle")
    canvas.words(450, 210, "3  pictures", anchor="middle", bold=True)
    canvas.line([(322, 236), (576, 236)], arrow=True, line=2.6)
    canvas.line([(576, 258), (322, 258)], arrow=True, line=2.6)
    canvas.box(40, 300, 820, 46, fill="#f6f6f6", round=6)
    canvas.words(450, 329, "network (UDP), or shared memory within one machine", anchor="middle")
    for x in (180, 720):
        canvas.line([(x, 300), (x, 274)], arrow=True, line=2)
        canvas.line([(x, 274), (x, 300)], arrow=True, line=2)
    return canvas.picture(
        "Two processes, each with the layers: your node, rclpy, rcl, rmw, Fast DDS. Below both lies the network, or "
        "shared memory within one machine. First each says to all who listen: I am here. Then they tell each other "
        "what they publish and subscribe to. Then the pictures come."
    )


def frames() -> Picture:
    """Three frames of a car, and a sign that one of them sees."""
    canvas = Canvas(330)
    for x, name, what in ((20, "map", "the hall"), (360, "car", "its middle"), (700, "camera", "on the car")):
        canvas.box(x, 40, 180, 84, look=0, round=10, line=2)
        canvas.words(x + 90, 76, name, anchor="middle", bold=True, size=22)
        canvas.words(x + 90, 106, what, anchor="middle")
    for x, kind, topic, often in ((200, "moves", "/tf", "every 0.1 s"), (540, "static", "/tf_static", "once")):
        canvas.line([(x, 82), (x + 156, 82)], arrow=True, line=2.6, dashed=kind == "moves")
        canvas.words(x + 78, 68, kind, anchor="middle", bold=True)
        canvas.words(x + 78, 108, topic, anchor="middle", size=17)
        canvas.words(x + 78, 130, often, anchor="middle", size=17)
    canvas.box(360, 220, 180, 60, look=3, round=10)
    canvas.words(450, 257, "stop sign", anchor="middle", bold=True, halo=True)
    canvas.line([(790, 124), (790, 250), (546, 250)], arrow=True, line=2.2)
    canvas.words(670, 214, "seen: 20 m ahead", anchor="middle")
    canvas.line([(110, 124), (110, 250), (354, 250)], arrow=True, line=2.2)
    canvas.words(232, 214, "wanted: at (5, 30)", anchor="middle")
    canvas.words(
        450, 318, "From the camera's frame to the map's: two transforms, one after the other.", anchor="middle"
    )
    return canvas.picture(
        "Three coordinate frames. From map to car leads a transform that moves, published every 0.1 s on /tf. From "
        "car to camera leads a static transform, published once on /tf_static. The camera sees a stop sign 20 m ahead; "
        "wanted is its place on the map, (5, 30). Two transforms, one after the other, lead there."
    )


DRAWINGS: dict[str, Callable[[], Picture]] = {
    "robot-layers": robot_layers,
    "two-helpers": two_helpers,
    "middleware": middleware,
    "frames": frames,
}
