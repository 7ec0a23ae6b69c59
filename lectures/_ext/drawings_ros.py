"""The drawings of what ROS 2 consists of, how nodes find each other, two robots, and the views of rqt_graph."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from autograder.core.results import Picture
from autograder.pictures.svg import Canvas

Node = tuple[str, float, float]
"""A node's name and the centre of its oval."""
Link = tuple[str, str, str]
"""From which node, to which node, and over what; the name of an action ends with ` (a)`, and its arrow is dashed."""


def layers_of_ros() -> Picture:
    """From a node down to the network."""
    canvas = Canvas(430)
    rows = (
        ("your node", "a program in Python or C++", 0),
        ("client library", "rclpy, rclcpp: nodes, topics, timers, executors", 4),
        ("rcl", "what both languages share, written in C", 5),
        ("rmw", "an interface that hides the middleware", 5),
        ("middleware", "Fast DDS, or Cyclone DDS, or Zenoh", 1),
        ("network", "shared memory, UDP, or TCP", 5),
    )
    for number, (head, below, look) in enumerate(rows):
        y = 20 + number * 66
        canvas.box(20, y, 860, 50, look=look, round=8)
        canvas.words(40, y + 32, head, bold=True, halo=True)
        canvas.words(240, y + 32, below, halo=True)
        if number:
            canvas.line([(140, y - 16), (140, y - 2)], arrow=True, line=2)
    return canvas.picture(
        "The layers of ROS 2, from top to bottom: your node; the client library, rclpy or rclcpp; rcl, which both "
        "languages share; rmw, an interface that hides the middleware; the middleware, for example Fast DDS; the "
        "network."
    )


def discovery() -> Picture:
    """Two processes find each other in two steps, then exchange data."""
    canvas = Canvas(370)
    for x, name, ends in (
        (20, "process 1: sonar", "publishes /distance"),
        (620, "process 2: brake", "subscribes to /distance"),
    ):
        canvas.box(x, 20, 260, 320, round=12, line=2)
        canvas.words(x + 130, 56, name, anchor="middle", bold=True)
        canvas.words(x + 130, 84, ends, anchor="middle", size=16)
    steps = (
        (132, "1  “I am here” (SPDP)", "every few seconds, to all"),
        (212, "2  lists of publishers", "and subscriptions (SEDP)"),
        (292, "3  messages", "from publisher to subscription"),
    )
    for y, head, below in steps:
        last = head.startswith("3")
        canvas.line([(280, y), (616, y)], arrow=True, line=2.4)
        if not last:
            canvas.line([(620, y + 6), (284, y + 6)], arrow=True, line=2.4, dashed=True)
        canvas.words(450, y - 12, head, anchor="middle", bold=True, size=17)
        canvas.words(450, y + 30, below, anchor="middle", size=16)
    return canvas.picture(
        "How two processes find each other. First each announces itself to all, every few seconds (SPDP). Then they "
        "send each other the lists of their publishers and subscriptions (SEDP). After that, messages go directly "
        "from the publisher to the subscription."
    )


def _robot(height: float, nodes: Sequence[Node], links: Sequence[Link], alt: str) -> Picture:
    """Nodes as ovals of one size, and an arrow with its name for each link."""
    canvas = Canvas(height)
    wide, high = 168, 58
    places = {name: (x, y) for name, x, y in nodes}
    for source, target, name in links:
        (x, y), (u, v) = places[source], places[target]
        if y != v and 0 < x - u < wide + 40:  # up and to the left
            begin, end = (x, y - high / 2), (u + wide / 2 + 4, v)
        elif abs(u - x) < wide:  # one above the other
            begin, end = (
                (x, y + (high / 2 if v > y else -high / 2)),
                (u, v + (-high / 2 - 4 if v > y else high / 2 + 4)),
            )
        else:
            side = wide / 2 if u > x else -wide / 2
            begin, end = (x + side, y), (u - side - (4 if u > x else -4), v)
        canvas.line([begin, end], arrow=True, line=2, dashed=name.endswith("(a)"))
    for source, target, name in links:
        (x, y), (u, v) = places[source], places[target]
        canvas.words(
            (x + u) / 2,
            (y + v) / 2 + (-8 if y == v else 5),
            name.removesuffix(" (a)"),
            anchor="middle",
            italic=True,
            size=16,
            halo=True,
        )
    for name, x, y in nodes:
        canvas.oval(x - wide / 2, y - high / 2, wide, high)
        canvas.words(x, y + 6, name, anchor="middle", size=17)
    return canvas.picture(alt)


def mobile_robot() -> Picture:
    """The nodes of a robot that drives."""
    return _robot(
        420,
        (
            ("lidar", 100, 60), ("wheels", 100, 340),
            ("localization", 360, 60), ("map server", 360, 200),
            ("planner", 620, 60), ("controller", 620, 340), ("task", 800, 200),
        ),
        (
            ("lidar", "localization", "scan"),
            ("wheels", "localization", "odom"),
            ("map server", "localization", "map"),
            ("localization", "planner", "pose"),
            ("map server", "planner", "map"),
            ("planner", "controller", "path"),
            ("controller", "wheels", "cmd_vel"),
            ("task", "planner", "drive to (a)"),
        ),
        "A mobile robot as a graph of nodes. The lidar sends scan, the wheels send odom and the map server sends "
        "map to the localization, which tells the planner the pose. The planner gets a goal from the task as an "
        "action, reads the map and sends a path to the controller. The controller sends cmd_vel to the wheels.",
    )  # fmt: skip


def manipulator() -> Picture:
    """The nodes of a robot arm."""
    return _robot(
        420,
        (
            ("camera", 100, 60), ("joints", 100, 340),
            ("perception", 360, 60), ("state publisher", 360, 200),
            ("motion planner", 620, 60), ("controller", 620, 340), ("task", 800, 200),
        ),
        (
            ("camera", "perception", "image"),
            ("joints", "state publisher", "joint_states"),
            ("perception", "motion planner", "objects"),
            ("state publisher", "motion planner", "tf"),
            ("motion planner", "controller", "trajectory (a)"),
            ("controller", "joints", "commands"),
            ("task", "motion planner", "grasp (a)"),
        ),
        "A robot arm as a graph of nodes. The camera sends images to the perception, which tells the motion planner "
        "where objects are. The joints report joint_states to the state publisher, which publishes all frames on "
        "tf. The motion planner gets a goal from the task as an action and sends a trajectory as an action to the "
        "controller, which commands the joints.",
    )  # fmt: skip


def rqt_graph() -> Picture:
    """One system as the kit draws it, and in two views of rqt_graph."""
    canvas = Canvas(420)
    canvas.words(20, 28, "ros.draw.graph()", bold=True)
    canvas.words(330, 28, "rqt_graph: “Nodes only”", bold=True)
    canvas.words(620, 28, "“Nodes/Topics (all)”", bold=True)
    for x in (305, 600):
        canvas.line([(x, 14), (x, 400)], grey=True)

    def oval(x: float, y: float, name: str) -> None:
        canvas.oval(x, y, 190, 50)
        canvas.words(x + 95, y + 31, name, anchor="middle", size=17)

    def box(x: float, y: float, name: str) -> None:
        canvas.box(x, y, 190, 44, round=2)
        canvas.words(x + 95, y + 28, name, anchor="middle", size=17)

    oval(60, 60, "/front/camera")
    box(60, 170, "/front/image")
    oval(60, 280, "/display")
    canvas.line([(155, 110), (155, 166)], arrow=True, line=2)
    canvas.line([(155, 214), (155, 276)], arrow=True, line=2)
    oval(355, 60, "/front/camera")
    oval(355, 280, "/display")
    canvas.line([(450, 110), (450, 276)], arrow=True, line=2)
    canvas.words(450, 200, "/front/image", anchor="middle", size=17, halo=True)
    canvas.box(625, 50, 255, 182, round=4, line=1.6, dashed=True)
    canvas.words(634, 224, "front", size=16, italic=True)
    oval(660, 60, "/front/camera")
    box(660, 160, "/front/image")
    oval(660, 280, "/display")
    canvas.line([(755, 110), (755, 156)], arrow=True, line=2)
    canvas.line([(755, 204), (755, 276)], arrow=True, line=2)
    canvas.words(20, 370, "names and quality", size=16)
    canvas.words(20, 394, "of service", size=16)
    canvas.words(320, 370, "the topic is", size=16)
    canvas.words(320, 394, "written on the arrow", size=16)
    canvas.words(615, 370, "a box for each namespace;", size=16)
    canvas.words(615, 394, "/rosout and debugging hidden", size=16)
    return canvas.picture(
        "One system in three views: a camera in the namespace /front and a display. In ros.draw.graph() nodes are "
        "ovals and the topic /front/image is a box between them. In the view Nodes only of rqt_graph, the topic's "
        "name stands on an arrow from the camera to the display. In the view Nodes/Topics (all), the topic is a box "
        "again, and a dashed frame named front surrounds what belongs to the namespace."
    )


DRAWINGS: dict[str, Callable[[], Picture]] = {
    "layers-of-ros": layers_of_ros,
    "discovery": discovery,
    "mobile-robot": mobile_robot,
    "manipulator": manipulator,
    "rqt-graph": rqt_graph,
}
