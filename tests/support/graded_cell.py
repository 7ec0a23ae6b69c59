"""One check cell, graded as the worker does it, on programs that a test writes."""

from __future__ import annotations

import linecache
import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from autograder.checks import current
from autograder.core.results import CheckResult, Isolation, Outcome, Status
from autograder.grading.job import Cell, Job
from autograder.grading.worker import run_job

SET_UP = """\
%load_ext autograder
from autograder.checks import Program, answers, launch, vary
from rclpy.qos import QoSProfile
from rcl_interfaces.msg import Log
from std_msgs.msg import Int32, String
from std_srvs.srv import Trigger
"""


TALKER = """
import rclpy
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Trigger


class Talker(Node):
    def __init__(self):
        super().__init__("talker")
        self.declare_parameter("word", "hello")
        self.declare_parameter("period", 0.05)
        self.count = 0
        self.publisher = self.create_publisher(String, "chatter", 10)
        self.create_service(Trigger, "how_many", self.how_many)
        self.create_timer(self.get_parameter("period").value, self.tick)

    def tick(self):
        self.publisher.publish(String(data=f"{self.get_parameter('word').value} {self.count}"))
        self.count += 1

    def how_many(self, request, response):
        response.success = True
        response.message = str(self.count)
        return response


def main():
    rclpy.init()
    rclpy.spin(Talker())


if __name__ == "__main__":
    main()
"""


Grade = Callable[..., CheckResult]


@pytest.fixture
def grade(tmp_path: Path) -> Iterator[Grade]:
    """Run one check cell on some programs, as the grading worker does."""

    def run(check: str, **programs: str) -> CheckResult:
        job = Job(
            student="student",
            lab="lab",
            digest="",
            isolation=Isolation.NONE,
            seed=7,
            files={name.replace("__", "."): text for name, text in programs.items()},
            cells=[
                Cell(grade_id="setup", source=SET_UP),
                Cell(grade_id="check", points=2, source=textwrap.dedent(check)),
            ],
        )
        (result,) = run_job(job, tmp_path)
        return result

    yield run
    current.check.close()
    linecache.clearcache()


def failure(result: CheckResult) -> Outcome:
    """The outcome that failed the check, which must have cost all points."""
    assert result.points == 0.0, result
    found = result.first_failure
    assert found is not None and found.status is Status.FAILED
    return found
