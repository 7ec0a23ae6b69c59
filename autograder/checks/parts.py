"""The parts of a check: requirements that give points of their own, whatever becomes of the others.

    with launch("talker") as ros:
        with ros.part("the name"):
            ros.node("/talker").expect()
        with ros.part("the numbers"):
            ros.topic("/numbers", Int64).expect_messages(at_least=5)
    ros.score({"the name": 1, "the numbers": 2})

What fails inside a part ends that part only. What fails outside takes every part of its launch.

So does a program that ends although it had to go on: when it ended is a matter of luck, and so is what was seen before.
It is not where the callback that failed had been called by the check itself, which sent a message or a request, or set
a parameter. Then what the parts before that came to stands.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator

from autograder.checks import current, outcomes
from autograder.checks.findings import Asked


@contextlib.contextmanager
def part(title: str) -> Iterator[None]:
    """Count what is found out inside the block for the part `title` of the score.

    Raises:
        ValueError: parts do not nest, and each has a title.
    """
    if current.check.findings.part or not title:
        raise ValueError(f"part({title!r}): parts have a title and do not nest.")
    current.check.findings.part = title
    try:
        yield
    except outcomes.LaunchEnded:
        raise
    except outcomes.CheckEnded:
        pass
    except Exception as error:
        if not outcomes.ends_part(error):
            raise
    finally:
        current.check.findings.part = ""
    current.check.findings.finished.add(title)


def asked(what: str) -> None:
    """Note that the check is about to send something: on this topic, to this service, or a "parameter"."""
    findings = current.check.findings
    findings.asked.append(Asked(time.monotonic(), what, frozenset(findings.finished)))


def before(what: str, when: float) -> frozenset[str]:
    """Titles of the parts that were finished before the check sent what led to a callback for `what` at this moment."""
    sent = [one for one in current.check.findings.asked if one.when < when and one.what == what]
    return sent[-1].parts if sent else frozenset()
