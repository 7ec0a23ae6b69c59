"""The concept drawings of lecture 6."""

from __future__ import annotations

from collections.abc import Callable

from autograder.core.results import Picture
from autograder.pictures.svg import Canvas


def goal_feedback_result() -> Picture:
    """What goes to and fro between a client and a server, from the top to the bottom."""
    canvas = Canvas(400)
    for x, name in ((120, "client"), (780, "server")):
        canvas.box(x - 80, 12, 160, 44, round=8, line=2)
        canvas.words(x, 41, name, anchor="middle", bold=True)
        canvas.line([(x, 56), (x, 390)], line=2, grey=True)
    steps = (
        ("goal: park, 10 m", True, False),
        ("accepted", False, True),
        ("feedback: 1 m driven", False, False),
        ("feedback: 2 m driven", False, False),
        ("cancel, if the client wants to", True, True),
        ("result: how far, and the status", False, False),
    )
    for number, (text, there, dashed) in enumerate(steps):
        y = 96 + number * 54
        start, end = (124, 774) if there else (776, 126)
        canvas.line([(start, y), (end, y)], arrow=True, line=2.2, dashed=dashed)
        canvas.words(450, y - 9, text, anchor="middle")
    return canvas.picture(
        "An action from top to bottom. The client sends a goal, the server answers that it accepts it. The "
        "server sends feedback again and again. The client may ask to cancel. In the end the server sends the"
        " result and the status."
    )


def goal_states() -> Picture:
    """The states of a goal."""
    canvas = Canvas(390)
    boxes = {
        "accepted": (10, 150, 0),
        "executing": (290, 150, 1),
        "canceling": (480, 280, 4),
        "succeeded": (720, 20, 2),
        "aborted": (720, 150, 5),
        "canceled": (720, 280, 3),
    }
    for name, (x, y, look) in boxes.items():
        canvas.box(x, y, 160, 70, look=look, round=10, line=2.4 if x == 720 else 1.2)
        canvas.words(x + 80, y + 42, name, anchor="middle", bold=x == 720, halo=True)
    canvas.line([(170, 185), (286, 185)], arrow=True, line=2)
    canvas.words(228, 172, "execute()", anchor="middle", size=17)
    canvas.line([(450, 170), (716, 62)], arrow=True, line=2)
    canvas.words(540, 92, "succeed()", anchor="middle", halo=True)
    canvas.line([(450, 185), (716, 185)], arrow=True, line=2)
    canvas.words(560, 176, "abort()", anchor="middle", halo=True)
    canvas.line([(390, 220), (478, 296)], arrow=True, line=2)
    canvas.words(340, 268, "cancel agreed", anchor="middle", size=17, halo=True)
    canvas.line([(640, 315), (716, 315)], arrow=True, line=2)
    canvas.words(678, 370, "canceled()", anchor="middle")
    canvas.words(20, 340, "An exception, or an end without", size=17)
    canvas.words(20, 364, "a word, is “aborted”.", size=17)
    return canvas.picture(
        "The states of a goal. Accepted becomes executing with execute(). From executing succeed() leads to "
        "succeeded and abort() to aborted. If the server agrees to cancel, the goal is canceling, and "
        "canceled() leads to canceled. An exception, or an end without one of these calls, is aborted."
    )


def who_takes_the_request() -> Picture:
    """Why one thread cannot be told to stop."""
    canvas = Canvas(330)
    canvas.words(20, 30, "one thread", bold=True)
    canvas.box(150, 50, 560, 50, look=1, round=4)
    canvas.words(430, 82, "drive: sleeps, looks, sleeps, looks …", anchor="middle", halo=True)
    canvas.box(714, 50, 100, 50, look=2, round=4)
    canvas.words(764, 82, "cancel", anchor="middle", halo=True)
    canvas.line([(300, 140), (300, 104)], arrow=True, line=2.2)
    canvas.words(310, 136, "stop! (waits until the thread is free: too late)")
    canvas.line([(20, 168), (880, 168)], grey=True)
    canvas.words(20, 202, "two threads", bold=True)
    canvas.box(150, 218, 200, 44, look=1, round=4)
    canvas.words(250, 247, "drive", anchor="middle", halo=True)
    canvas.box(300, 272, 100, 44, look=2, round=4)
    canvas.words(350, 301, "cancel", anchor="middle", halo=True)
    canvas.line([(300, 200), (300, 268)], arrow=True, line=2.2)
    canvas.words(310, 208, "stop!")
    canvas.words(420, 247, "“drive” looks, sees the request, and ends")
    canvas.words(420, 301, "the other thread takes the request at once")
    return canvas.picture(
        "Above, one thread: drive sleeps and looks in turns; the request to stop waits until the thread is "
        "free, which is too late. Below, two threads: the second one takes the request at once, drive sees it"
        " and ends."
    )


def a_new_goal() -> Picture:
    """What may become of a goal that comes while another one is executed."""
    canvas = Canvas(380)
    rows = (
        ("nothing written", "both at once", ((150, 400, "old"),), ((290, 330, "new"),)),
        ("queue", "one after the other", ((150, 300, "old"),), ((454, 280, "new"),)),
        ("preemption", "the new one counts", ((150, 150, "old"),), ((304, 330, "new"),)),
    )
    for number, (title, says, old, new) in enumerate(rows):
        y = 14 + number * 122
        canvas.words(10, y + 30, title, bold=True)
        canvas.words(10, y + 96, says, size=17, italic=True)
        for bars, height, look in ((old, y + 12, 1), (new, y + 48, 0)):
            for x, width, text in bars:
                canvas.box(x + 60, height, width, 32, look=look, round=4)
                canvas.words(x + 60 + width / 2, height + 23, text, anchor="middle", halo=True)
        canvas.line([(350, y + 4), (350, y + 84)], line=1.6, dashed=True)
    canvas.words(360, 376, "the new goal comes", size=17)
    return canvas.picture(
        "What becomes of a goal that comes while another is executed. If nothing is written, both are "
        "executed at once. With a queue, one after the other. With preemption the old one ends, and the new "
        "one is executed."
    )


DRAWINGS: dict[str, Callable[[], Picture]] = {
    "goal-feedback-result": goal_feedback_result,
    "goal-states": goal_states,
    "who-takes-the-request": who_takes_the_request,
    "a-new-goal": a_new_goal,
}
