"""The concept drawings of lecture 3."""

from __future__ import annotations

from autograder.core.results import Picture
from autograder.pictures.svg import Canvas


def name_and_rule() -> Picture:
    """How a remap rule is compared with a name."""
    canvas = Canvas(330)
    canvas.words(20, 30, "started with  -r __ns:=/front  -r image:=picture", size=17)
    for y, head, text in ((86, "the name in the code", "image"), (206, "the rule's two sides", "image := picture")):
        canvas.words(20, y - 14, head, bold=True)
        canvas.box(20, y, 220, 54, look=0 if text == "image" else 1, round=6)
        canvas.words(130, y + 33, text, anchor="middle", halo=True)
        canvas.line([(240, y + 27), (356, y + 27)], arrow=True, line=2.2)
        canvas.words(298, y + 16, "made full", anchor="middle", size=16)
        canvas.box(360, y, 180, 54, round=6, line=2)
        canvas.words(450, y + 33, "/front/image", anchor="middle", bold=True)
    canvas.line([(450, 144), (450, 166)], line=2.2)
    canvas.words(450, 184, "equal?", anchor="middle", bold=True)
    canvas.line([(450, 192), (450, 204)], line=2.2)
    canvas.line([(490, 178), (656, 178)], arrow=True, line=2.2)
    canvas.words(573, 166, "yes", anchor="middle")
    canvas.box(660, 150, 220, 54, look=2, round=6)
    canvas.words(770, 183, "/front/picture", anchor="middle", bold=True, halo=True)
    canvas.words(770, 134, "the right side, made full", anchor="middle", size=16)
    canvas.words(20, 310, "no: the name stays /front/image, and nobody says that the rule did nothing", size=17)
    return canvas.picture(
        "How a remap rule is compared with a name, in the namespace /front. The name image in the code is made a full "
        "name, /front/image. The left side of the rule image:=picture is made a full name, too. Both are equal, so the "
        "new name is the right side, made full: /front/picture. If they were not equal, the name would stay as it is, "
        "without a word."
    )


def asked_and_told() -> Picture:
    """What happens to a parameter's new value before it counts, and after."""
    canvas = Canvas(300)
    steps = (
        ("the caller", "param set rate 40.0", 5),
        ("check", "may it be set?", 1),
        ("the value", "is 40.0 from now on", 0),
        ("follow", "what must be updated?", 2),
    )
    for number, (head, below, look) in enumerate(steps):
        x = 20 + number * 224
        canvas.box(x, 70, 186, 84, look=look, round=10)
        canvas.words(x + 93, 104, head, anchor="middle", bold=True, halo=True)
        canvas.words(x + 93, 136, below, anchor="middle", size=16, halo=True)
        if number:
            canvas.line([(x - 38, 112), (x - 4, 112)], arrow=True, line=2.4)
    canvas.words(337, 50, "before: can refuse", anchor="middle")
    canvas.words(785, 50, "after: cannot refuse", anchor="middle")
    canvas.line([(337, 154), (337, 214), (113, 214), (113, 160)], arrow=True, line=2.2, dashed=True)
    canvas.words(225, 240, "refused, with a reason", anchor="middle")
    canvas.words(20, 284, "A range and read_only are looked at first, without any code of yours.", size=17)
    return canvas.picture(
        "The way of a new parameter value. The caller sets it. The callback check is asked before and can refuse it; "
        "then a reason goes back to the caller. Otherwise the value changes, and the callback follow is told "
        "afterwards; it makes anew what depends on the value and cannot refuse any more."
    )


DRAWINGS = {"name-and-rule": name_and_rule, "asked-and-told": asked_and_told}
