"""The concept drawings of lecture 4."""

from __future__ import annotations

from autograder.core.results import Picture
from autograder.pictures import lifecycle
from autograder.pictures.svg import Canvas


def state_machine() -> Picture:
    """The four states, without a way."""
    return lifecycle("", [])


def lifecycle_switch() -> Picture:
    """What a state switches, and what it does not."""
    canvas = Canvas(366)
    canvas.box(20, 40, 640, 300, round=14, fill="#f6f6f6", line=2)
    canvas.words(36, 70, "a lifecycle node", bold=True)
    canvas.box(50, 150, 170, 60, look=1, round=6)
    canvas.words(135, 187, "timer: look", anchor="middle", halo=True)
    canvas.box(400, 86, 230, 70, round=6, line=2)
    canvas.words(515, 116, "lifecycle publisher", anchor="middle", bold=True)
    canvas.words(515, 142, "on only while active", anchor="middle", size=16)
    canvas.box(400, 180, 230, 56, look=0, round=6)
    canvas.words(515, 215, "ordinary publisher", anchor="middle")
    canvas.box(400, 262, 230, 56, look=2, round=6)
    canvas.words(515, 297, "subscription", anchor="middle", halo=True)
    canvas.line([(220, 170), (300, 121)], line=2.2)
    canvas.line([(300, 121), (344, 96)], line=3.4)
    canvas.oval(295, 116, 10, 10)
    canvas.oval(351, 116, 10, 10)
    canvas.line([(356, 121), (396, 121)], arrow=True, line=2.2)
    canvas.words(300, 84, "switch", anchor="middle", italic=True, size=16)
    canvas.line([(220, 190), (396, 208)], arrow=True, line=2.2)
    canvas.line([(630, 121), (720, 121)], arrow=True, line=2.2)
    canvas.line([(630, 208), (720, 208)], arrow=True, line=2.2)
    canvas.line([(720, 290), (634, 290)], arrow=True, line=2.2)
    canvas.words(730, 127, "only while active")
    canvas.words(730, 214, "in every state")
    canvas.words(730, 296, "in every state")
    return canvas.picture(
        "A lifecycle node with a timer, a lifecycle publisher, an ordinary publisher and a subscription. Between the "
        "timer and the lifecycle publisher stands a switch that is on only while the node is active. The timer, the "
        "ordinary publisher and the subscription have no switch: they work in every state."
    )


def three_endings() -> Picture:
    """Where the three results of a transition callback lead."""
    canvas = Canvas(400)
    canvas.box(20, 150, 190, 76, round=10, line=2)
    canvas.words(115, 182, "on_activate", anchor="middle", bold=True)
    canvas.words(115, 208, "or another one", anchor="middle", size=16)
    rows = (
        (36, "SUCCESS", "the next state", 2),
        (150, "FAILURE", "the state before", 4),
        (270, "ERROR, exception", "on_error", 6),
    )
    for y, ending, goal, look in rows:
        canvas.line([(210, 188), (290, y + 30)], arrow=True, line=2.2)
        canvas.box(294, y, 190, 60, look=look, round=6)
        canvas.words(389, y + 36, ending, anchor="middle", halo=True)
        canvas.line([(484, y + 30), (544, y + 30)], arrow=True, line=2.2)
        canvas.box(548, y, 170, 60, round=10, line=2)
        canvas.words(633, y + 36, goal, anchor="middle", bold=goal == "on_error")
    canvas.words(724, 66, "for example active", size=16)
    canvas.words(724, 180, "try again later", size=16)
    canvas.words(633, 230, "shutdown: finalized", anchor="middle", size=16, italic=True)
    canvas.line([(718, 292), (746, 272)], arrow=True, line=2.2)
    canvas.line([(718, 308), (746, 328)], arrow=True, line=2.2)
    canvas.words(740, 234, "SUCCESS:", size=16)
    canvas.words(752, 262, "unconfigured", bold=True, size=17)
    canvas.words(752, 344, "finalized", bold=True, size=17)
    canvas.words(740, 372, "(not SUCCESS)", size=16)
    return canvas.picture(
        "Three ways in which a transition callback ends. SUCCESS leads to the next state. FAILURE leads back to the "
        "state before; only with shutdown, FAILURE leads to finalized, too. ERROR, or an exception, leads to on_error: "
        "if that returns SUCCESS the node is unconfigured, otherwise it is finalized."
    )


def layers() -> Picture:
    """Bring-up in order, the way down in reverse."""
    canvas = Canvas(300)
    for number, name in enumerate(("camera", "perception", "steering")):
        x = 60 + number * 280
        canvas.box(x, 100, 220, 84, look=(0, 2, 1)[number], round=10)
        canvas.words(x + 110, 134, name, anchor="middle", bold=True, halo=True)
        canvas.words(x + 110, 166, "configure, activate", anchor="middle", size=16, halo=True)
        canvas.badge(x + 18, 100, str(number + 1))
        if number:
            canvas.line([(x - 60, 142), (x - 4, 142)], arrow=True, line=2.4)
    canvas.words(60, 56, "Up: each part only when the one before it is active")
    canvas.line([(840, 216), (840, 244), (64, 244)], arrow=True, line=2.4, dashed=True)
    canvas.words(450, 280, "Down, if one is not ready: the last one first", anchor="middle")
    return canvas.picture(
        "Bring-up in layers: camera, perception and steering are configured and activated one after the other. If one "
        "of them is not ready, the way down goes in the reverse order."
    )


DRAWINGS = {
    "state-machine": state_machine,
    "lifecycle-switch": lifecycle_switch,
    "three-endings": three_endings,
    "layers": layers,
}
