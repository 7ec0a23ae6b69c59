"""The concept drawings of lecture 1."""

from __future__ import annotations

from collections.abc import Callable

from autograder.core.results import Picture
from autograder.pictures.svg import Canvas


def one_loop_or_nodes() -> Picture:
    """A program that does everything in turn, and three nodes that do one thing each."""
    canvas = Canvas(380)
    canvas.words(20, 28, "one program", bold=True)
    for number, (text, look) in enumerate((("measure", 0), ("brake if near", 2), ("report", 1))):
        canvas.box(60, 50 + number * 92, 220, 58, look=look, round=8)
        canvas.words(170, 86 + number * 92, text, anchor="middle", halo=True)
        if number:
            canvas.line([(170, 16 + number * 92), (170, 48 + number * 92)], arrow=True, line=2)
    canvas.path("M60 264H30V79H56", arrow=True, line=2)
    canvas.words(20, 340, "When “report” hangs,", size=17)
    canvas.words(20, 364, "nobody measures and nobody brakes.", size=17)
    canvas.line([(385, 20), (385, 370)], grey=True)
    canvas.words(410, 28, "three nodes", bold=True)
    canvas.oval(420, 128, 140, 70)
    canvas.words(490, 169, "sonar", anchor="middle")
    for y, name in ((50, "brake"), (206, "workshop")):
        canvas.oval(730, y, 150, 70)
        canvas.words(805, y + 41, name, anchor="middle")
        canvas.line([(562, 163), (728, y + 35)], arrow=True, line=2)
    canvas.words(645, 168, "distance", anchor="middle", italic=True, halo=True)
    canvas.words(410, 340, "When “workshop” hangs, its messages wait.", size=17)
    canvas.words(410, 364, "The brake does not notice.", size=17)
    return canvas.picture(
        "On the left one program that goes round: it measures, brakes if something is near, and reports. When "
        "reporting hangs, nobody measures and nobody brakes. On the right three nodes: the sonar sends its distance "
        "to the brake and to the workshop. When the workshop hangs, the brake does not notice."
    )


def topic() -> Picture:
    """Any number of publishers, any number of subscriptions, one name and one type."""
    canvas = Canvas(330)
    canvas.words(20, 28, "publishers", bold=True)
    canvas.words(880, 28, "subscriptions", bold=True, anchor="end")
    for y, name in ((70, "sonar"), (190, "lidar")):
        canvas.oval(30, y, 150, 66)
        canvas.words(105, y + 39, name, anchor="middle")
        canvas.line([(182, y + 33), (318, 163)], arrow=True, line=2)
    canvas.box(320, 120, 260, 86, look=0, round=6)
    canvas.words(450, 156, "topic /distance", anchor="middle", bold=True, halo=True)
    canvas.words(450, 186, "sensor_msgs/msg/Range", anchor="middle", size=16, halo=True)
    for y, name in ((50, "brake"), (130, "workshop"), (210, "display")):
        canvas.oval(720, y, 150, 66)
        canvas.words(795, y + 39, name, anchor="middle")
        canvas.line([(582, 163), (718, y + 33)], arrow=True, line=2)
    canvas.words(
        450, 312, "Each message goes to every subscription. Nobody knows who is at the other end.", anchor="middle"
    )
    return canvas.picture(
        "A topic. Two publishers, sonar and lidar, send messages to the topic /distance of the type Range. Three "
        "subscriptions, in brake, workshop and display, get every message. Nobody knows who is at the other end."
    )


def service() -> Picture:
    """One request, one response."""
    canvas = Canvas(280)
    canvas.oval(40, 80, 200, 90)
    canvas.words(140, 120, "starter", anchor="middle", bold=True)
    canvas.words(140, 146, "client", anchor="middle", size=16)
    canvas.oval(660, 80, 200, 90)
    canvas.words(760, 120, "brake", anchor="middle", bold=True)
    canvas.words(760, 146, "server", anchor="middle", size=16)
    canvas.words(450, 40, "service /check_brake, std_srvs/srv/Trigger", anchor="middle", italic=True)
    canvas.path("M238 105H656", arrow=True, line=2.4)
    canvas.words(450, 95, "1  request", anchor="middle")
    canvas.path("M660 148H244", arrow=True, line=2.4, dashed=True)
    canvas.words(450, 174, "2  response", anchor="middle")
    canvas.words(450, 228, "One response for each request, if the server is there and answers.", anchor="middle")
    canvas.words(450, 258, "The client decides how long it is ready to wait.", anchor="middle")
    return canvas.picture(
        "A service. The client, starter, sends a request to the server, brake; the server sends one response back, if "
        "it is there and answers. The client decides how long it is ready to wait."
    )


def which_of_four() -> Picture:
    """Three questions that lead to topic, service, action or parameter."""
    canvas = Canvas(400)
    questions = (
        ("Does it flow, for whoever listens?", "topic", "distances, pictures, states", 0),
        ("Is it a setting of one node?", "parameter", "rate, limit, device", 4),
        ("Does it take long? Do you want to stop it?", "action", "park the car", 1),
        ("Otherwise: asked once, done at once", "service", "check the brake", 2),
    )
    for number, (question, answer, example, look) in enumerate(questions):
        y = 16 + number * 96
        canvas.box(20, y, 430, 66, round=10)
        canvas.words(235, y + 40, question, anchor="middle", size=18)
        canvas.line([(450, y + 33), (536, y + 33)], arrow=True, line=2)
        canvas.box(540, y, 340, 66, look=look, round=6)
        canvas.words(710, y + 29, answer, anchor="middle", bold=True, halo=True)
        canvas.words(710, y + 54, example, anchor="middle", size=17, halo=True)
        if number < len(questions) - 1:
            canvas.line([(235, y + 66), (235, y + 94)], arrow=True, line=2)
            canvas.words(252, y + 87, "no", size=17)
            canvas.words(492, y + 25, "yes", size=17, anchor="middle")
    return canvas.picture(
        "Which of the four? Does it flow, for whoever listens: a topic, such as distances. If not, is it a setting of "
        "one node: a parameter, such as a rate. If not, does it take long or should it be possible to stop it: an "
        "action, such as parking the car. Otherwise it is asked once and done at once: a "
        "service, such as checking the brake."
    )


DRAWINGS: dict[str, Callable[[], Picture]] = {
    "one-loop-or-nodes": one_loop_or_nodes,
    "topic": topic,
    "service": service,
    "which-of-four": which_of_four,
}
