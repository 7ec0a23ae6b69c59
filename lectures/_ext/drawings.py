"""Concept drawings, made with the canvas of the kit's pictures: the directive `drawing NAME` puts one on a page."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import drawings_actions
import drawings_bringup
import drawings_lifecycle
import drawings_names
import drawings_nodes
import drawings_packages
import drawings_qos
import drawings_ros
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from autograder.core.results import Picture
from autograder.pictures.svg import Canvas


def executor_loop() -> Picture:
    """What an executor does, again and again."""
    canvas = Canvas(330)
    canvas.words(20, 30, "ready events", bold=True)
    for number, text in enumerate(("timer is due", "message has come", "request has come", "answer has come")):
        canvas.box(20, 46 + number * 62, 190, 46, look=number, round=6)
        canvas.words(115, 75 + number * 62, text, anchor="middle", halo=True)
        canvas.line([(210, 69 + number * 62), (300, 160)], arrow=True)
    for x, head, below in ((310, "1  wait", "for something ready"), (510, "2  collect", "what is ready now"),
                           (710, "3  run", "callback after callback")):  # fmt: skip
        canvas.box(x, 110, 170, 100, round=12, line=2)
        canvas.words(x + 85, 152, head, anchor="middle", bold=True, size=22)
        canvas.words(x + 85, 186, below, anchor="middle", size=14)
    canvas.line([(480, 160), (510, 160)], arrow=True, line=2.4)
    canvas.line([(680, 160), (710, 160)], arrow=True, line=2.4)
    canvas.path("M795 210V268H395V210", arrow=True, line=2.4)
    canvas.words(595, 290, "again, until the program ends", anchor="middle")
    return canvas.picture(
        "The loop of an executor in three steps: it waits until a timer is due or a message, a request or an answer "
        "has come; it collects what is ready now; it runs one callback after the other; then it waits again."
    )


def groups_and_threads() -> Picture:
    """Two conditions for a callback to start."""
    canvas = Canvas(380)
    canvas.words(20, 28, "node: callbacks in their groups", bold=True)
    canvas.box(20, 44, 400, 120, round=10, fill="#f6f6f6")
    canvas.words(36, 70, "default group (exclusive)", italic=True, size=16)
    for x, name, look in ((40, "camera", 1), (180, "map", 2)):
        canvas.box(x, 88, 120, 54, look=look, round=6)
        canvas.words(x + 60, 121, name, anchor="middle", halo=True)
    canvas.words(316, 120, "one at a time", size=15)
    canvas.box(20, 190, 400, 120, round=10, fill="#f6f6f6")
    canvas.words(36, 216, "a group of its own (exclusive)", italic=True, size=16)
    canvas.box(40, 234, 120, 54, look=0, round=6)
    canvas.words(100, 267, "heartbeat", anchor="middle")
    canvas.words(560, 28, "executor: threads", bold=True)
    for number in range(3):
        canvas.box(560, 60 + number * 84, 320, 58, round=6, line=2)
        canvas.words(574, 94 + number * 84, f"thread {number + 1}")
    canvas.box(670, 68, 190, 42, look=1)
    canvas.words(765, 95, "camera", anchor="middle", halo=True)
    canvas.box(670, 152, 190, 42, look=0)
    canvas.words(765, 179, "heartbeat", anchor="middle")
    canvas.words(765, 263, "free", anchor="middle", italic=True)
    canvas.line([(420, 104), (556, 89)], arrow=True, line=2.2)
    canvas.line([(420, 250), (556, 173)], arrow=True, line=2.2)
    canvas.words(20, 348, "A callback starts when two things are free: a thread, and its group.", bold=True)
    canvas.words(20, 372, "Thread 3 is free, and still “map” waits: its group is busy with “camera”.", size=16)
    return canvas.picture(
        "Callback groups and threads. The default group holds camera and map, a second group holds heartbeat. Thread 1 "
        "runs camera, thread 2 runs heartbeat, thread 3 is free. Still map waits, because its group is busy with "
        "camera: a callback starts only when a thread is free and its group is free."
    )


def waiting_for_itself() -> Picture:
    """The deadlock of a service call inside a callback."""
    canvas = Canvas(300)
    canvas.box(40, 60, 300, 90, round=12, line=2)
    canvas.words(190, 98, "the callback", anchor="middle", bold=True)
    canvas.words(190, 128, "is inside client.call()", anchor="middle", size=16)
    canvas.box(560, 60, 300, 90, round=12, line=2)
    canvas.words(710, 98, "the answer", anchor="middle", bold=True)
    canvas.words(710, 128, "lies ready, nobody takes it", anchor="middle", size=16)
    canvas.path("M340 85H555", arrow=True, line=2.4)
    canvas.words(450, 74, "waits for", anchor="middle")
    canvas.path("M560 130H345", arrow=True, line=2.4)
    canvas.words(450, 156, "waits for", anchor="middle")
    canvas.words(450, 216, "The callback keeps the thread (or the group) until the answer has come.", anchor="middle")
    canvas.words(450, 246, "The answer needs this very thread (or group) in order to be taken.", anchor="middle")
    canvas.words(450, 280, "Nothing moves any more: a deadlock.", anchor="middle", bold=True)
    return canvas.picture(
        "A deadlock. The callback is inside client.call and waits for the answer. The answer lies ready and waits for "
        "the thread, or the callback group, that the callback keeps. Neither can go on."
    )


DRAWINGS: dict[str, Callable[[], Picture]] = {
    "executor-loop": executor_loop,
    "groups-and-threads": groups_and_threads,
    "waiting-for-itself": waiting_for_itself,
    **drawings_lifecycle.DRAWINGS,
    **drawings_names.DRAWINGS,
    **drawings_nodes.DRAWINGS,
    **drawings_ros.DRAWINGS,
    **drawings_qos.DRAWINGS,
    **drawings_packages.DRAWINGS,
    **drawings_bringup.DRAWINGS,
    **drawings_actions.DRAWINGS,
}


class Drawing(SphinxDirective):
    """The directive `drawing`."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Put the drawing here."""
        return [nodes.raw("", f"<p>{DRAWINGS[self.arguments[0]]().html()}</p>", format="html")]


def setup(app: Sphinx) -> dict[str, Any]:
    """Register with Sphinx."""
    app.add_directive("drawing", Drawing)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
