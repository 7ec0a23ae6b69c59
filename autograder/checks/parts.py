"""The parts of a check: requirements that give points of their own, whatever becomes of the others.

    with launch("talker") as ros:
        with ros.part("the name"):
            ros.expect_node("/talker")
        with ros.part("the numbers"):
            ros.expect_messages("/numbers", Int64, at_least=5)
    ros.score({"the name": 1, "the numbers": 2})

What fails inside a part ends that part only. What fails outside takes every part of its launch, and so does a program
that ends although it had to go on.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from autograder.checks import findings, outcomes


@contextlib.contextmanager
def part(title: str) -> Iterator[None]:
    """Count what is found out inside the block for the part `title` of the score.

    Raises:
        ValueError: parts do not nest, and each has a title.
    """
    if findings.current.part or not title:
        raise ValueError(f"part({title!r}): parts have a title and do not nest.")
    findings.current.part = title
    try:
        yield
    except outcomes.LaunchEnded:
        raise
    except outcomes.CheckEnded:
        pass
    finally:
        findings.current.part = ""
