"""The concept drawings of lecture 5."""

from __future__ import annotations

from autograder.core.results import Picture
from autograder.pictures.svg import Canvas


def offered_requested() -> Picture:
    """The scale of each policy, and which requests an offer fulfils."""
    canvas = Canvas(350)
    canvas.words(20, 34, "weak", italic=True)
    canvas.line([(80, 28), (810, 28)], arrow=True, line=2)
    canvas.words(822, 34, "strict", italic=True)
    rows = (
        ("reliability", "best effort", "reliable"),
        ("durability", "volatile", "transient local"),
        ("deadline, lease", "none", "short"),
    )
    for number, (policy, weak, strict) in enumerate(rows):
        y = 62 + number * 66
        canvas.words(20, y + 31, policy, bold=True)
        canvas.box(230, y, 250, 48, fill="#ffffff", round=6)
        canvas.words(355, y + 31, weak, anchor="middle")
        canvas.box(560, y, 250, 48, look=0, round=6)
        canvas.words(685, y + 31, strict, anchor="middle")
        canvas.line([(560, y + 24), (484, y + 24)], arrow=True, line=2.6)
        canvas.words(522, y + 17, "✓", anchor="middle", bold=True)
    canvas.words(20, 294, "Who offers the right side serves both. Who offers the left side", bold=True)
    canvas.words(20, 320, "serves only the left side.", bold=True)
    return canvas.picture(
        "Three policies, each from weak to strict: reliability from best effort to reliable, durability from volatile "
        "to transient local, deadline and lease from none to short. A publisher that offers the strict end serves "
        "both ends; one that offers the weak end serves only the weak one."
    )


def two_queues() -> Picture:
    """From publish to the callback."""
    canvas = Canvas(330)
    canvas.box(20, 60, 260, 190, round=12, fill="#f6f6f6", line=2)
    canvas.words(36, 90, "publisher", bold=True)
    canvas.box(620, 60, 260, 190, round=12, fill="#f6f6f6", line=2)
    canvas.words(636, 90, "subscription", bold=True)
    for number in range(5):
        canvas.box(40 + number * 44, 116, 40, 50, look=0)
        canvas.words(60 + number * 44, 148, str(16 + number), anchor="middle")
    for number in range(3):
        canvas.box(640 + number * 44, 116, 40, 50, look=0)
        canvas.words(660 + number * 44, 148, str(18 + number), anchor="middle")
    canvas.words(40, 196, "depth 5", size=16)
    canvas.words(640, 196, "depth 3", size=16)
    canvas.words(40, 218, "kept to send again,", size=16)
    canvas.words(40, 238, "and for late joiners", size=16)
    canvas.words(640, 218, "waits for the callback", size=16)
    canvas.line([(284, 141), (614, 141)], arrow=True, line=2.6)
    canvas.words(450, 124, "the network", anchor="middle")
    canvas.words(450, 172, "reliable: sent again until", anchor="middle", size=16)
    canvas.words(450, 192, "it is in the other queue", anchor="middle", size=16)
    canvas.line([(650, 116), (606, 44)], arrow=True, dashed=True, line=2.2)
    canvas.words(660, 30, "pushed out by newer ones, silently", anchor="end", size=16)
    canvas.line([(780, 250), (780, 284)], arrow=True, line=2.2)
    canvas.words(780, 308, "your callback", anchor="middle", bold=True)
    return canvas.picture(
        "Two queues between publish and the callback. The publisher keeps the last five messages, to send them again "
        "and for late joiners. Reliable repeats a message until it is in the subscription's queue, which holds three "
        "and pushes out older ones without a word. From there the callback takes them."
    )


DRAWINGS = {"offered-requested": offered_requested, "two-queues": two_queues}
