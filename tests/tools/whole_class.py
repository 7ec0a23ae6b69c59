"""Take a class through a lab on a real JupyterHub, all students at once, with a restart of the hub in the middle.

`make hub USERS=30`. Each student fetches the lab, starts a robot, looks for the nodes of the others, checks, submits,
and fetches the feedback. The table at the end says how long this took, who had full points, who saw another student's
nodes, how many kernels did not come up, and what a student costs. Exit status 1 if a student lacks points or sees
another one. It needs what the hub of `make test-all` needs: root, JupyterHub and its proxy.
"""

from __future__ import annotations

import argparse
import os
import pwd
import re
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from statistics import mean

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

import real_hub
from real_hub import LAB, Hub, Person, processes_of, space_of, wait_for
from rich.console import Console
from rich.table import Table

from autograder.course.lab import load_lab

GRADER, STUDENT = "hub-t-grader", "hub-t-s{:02}"
TICK = os.sysconf("SC_CLK_TCK")


@dataclass
class Seen:
    """What came of a student."""

    others: set[str] = field(default_factory=set)
    """The namespaces of other students' robots that this student saw."""
    points: str = "no feedback"
    megabytes: float = 0.0
    """The memory of all of the student's processes while the robot ran (PSS)."""
    seconds: float = 0.0
    """The CPU time of all of the student's processes."""


class Term:
    """The steps of all students; each step ends when the last student has done it."""

    def __init__(self, hub: Hub, say: Callable[[str], None]) -> None:
        self.hub, self.say = hub, say
        self.seen = {name: Seen() for name in hub.students}
        self.people: list[Person] = []

    def all_at_once(self, told: str, step: Callable[[Person], None]) -> None:
        """Let every student do a step at the same time."""
        began = time.monotonic()
        with ThreadPoolExecutor(len(self.people)) as pool:
            list(pool.map(step, self.people))
        self.say(f"{told}: {time.monotonic() - began:.0f} s")

    def run(self) -> None:
        """Take the class from the login to the feedback."""
        solved = {name: answer.solution for name, answer in load_lab(self.hub.course, LAB).answers.items()}
        grader = Person(self.hub, GRADER)
        grader.start()
        real_hub.release_lab(grader)
        self.people = [Person(self.hub, name) for name in self.hub.students]
        self.all_at_once("log in, and start the servers", lambda person: person.start())
        self.all_at_once("fetch the lab", lambda person: person.assignment("fetch"))
        self.all_at_once("write the answers, and open the notebook", lambda one: real_hub.write_answers(one, solved))
        self.all_at_once("start a robot", lambda person: real_hub.start_robot(person, solved["greeter"]))
        self.all_at_once("look for the others", self.look)
        for name, seen in self.seen.items():
            seen.megabytes = memory_of(name)
        self.hub.stop()
        self.hub.start()
        self.all_at_once("find the robot again after a restart of the hub", self.go_on)
        self.all_at_once("check, and submit", self.check_and_submit)
        began = time.monotonic()
        real_hub.grade_class(grader)
        self.say(f"grade, and release the feedback: {time.monotonic() - began:.0f} s")
        self.all_at_once("fetch the feedback", self.fetch_feedback)
        for name, seen in self.seen.items():
            seen.seconds = cpu_time_of(name)

    def look(self, person: Person) -> None:
        """Look for the own robot and for those of others."""
        told = person.run("%ros2 node list") + person.run("%ros2 topic list")
        spaces = set(re.findall(r"/(hub_t_\w+)/", told))
        assert space_of(person.name) in spaces, f"{person.name} does not see the own robot: {told}"
        self.seen[person.name].others |= spaces - {space_of(person.name)}

    def go_on(self, person: Person) -> None:
        """Find the server and the robot as they were before the restart."""
        wait_for(lambda: person.get("api/status").ok, f"the server of {person.name} is lost with the hub")
        self.look(person)
        person.run("robot.stop()")

    def check_and_submit(self, person: Person) -> None:
        """Run the checks in the notebook's folder, and hand in."""
        told = person.run(f"!autograder check {LAB}.ipynb")
        assert "5 of 5" in " ".join(told.split()), told
        person.assignment("submit")

    def fetch_feedback(self, person: Person) -> None:
        """Fetch the feedback, and note the points in it."""
        person.assignment("fetch_feedback")
        labs = self.hub.place / person.name / "labs"
        pages = wait_for(lambda: list(labs.glob(f"**/feedback/**/{LAB}.html")), f"{person.name} gets no feedback")
        points = re.search(r"[\d.]+ of [\d.]+ points", pages[0].read_text(encoding="utf-8"))
        self.seen[person.name].points = points[0] if points else "no points on the page"


def memory_of(user: str) -> float:
    """Return the memory of a user's processes in MB; what several of them share counts in parts (PSS)."""
    kilobytes = 0
    for process in processes_of(pwd.getpwnam(user).pw_uid):
        try:
            rollup = (process / "smaps_rollup").read_text(encoding="utf-8")
        except OSError:
            continue  # it has ended
        kilobytes += int(rollup.split("Pss:")[1].split()[0])
    return kilobytes / 1000


def cpu_time_of(user: str) -> float:
    """Return the CPU seconds of a user's processes and of their children that have ended."""
    ticks = 0
    for process in processes_of(pwd.getpwnam(user).pw_uid):
        try:
            fields = (process / "stat").read_text(encoding="utf-8").rpartition(")")[2].split()
        except OSError:
            continue  # it has ended
        ticks += sum(int(each) for each in fields[11:15])
    return ticks / TICK


def table(term: Term, minutes: float, grader: tuple[float, float]) -> Table:
    """Return the table of what came of the class."""
    seen = term.seen.values()
    rows: Sequence[tuple[str, str]] = [
        ("students", f"{len(seen)}"),
        ("minutes, without setting up the hub", f"{minutes:.1f}"),
        ("students with full points", f"{sum(one.points == '5 of 5 points' for one in seen)}"),
        ("students who saw another one's nodes or topics", f"{sum(bool(one.others) for one in seen)}"),
        ("kernels that did not come up at first", f"{sum(person.lost_kernels for person in term.people)}"),
        ("memory of a student with a running robot, MB (PSS)", f"{mean(one.megabytes for one in seen):.0f}"),
        ("memory of all students, GB (PSS)", f"{sum(one.megabytes for one in seen) / 1000:.1f}"),
        ("CPU time of a student, s", f"{mean(one.seconds for one in seen):.1f}"),
        ("memory of the graders' server, MB (PSS)", f"{grader[0]:.0f}"),
        ("CPU time of the graders' server, s", f"{grader[1]:.1f}"),
    ]
    made = Table("what", "figure", title=f"A class on a JupyterHub, {os.cpu_count()} cores")
    for row in rows:
        made.add_row(*row)
    return made


def main() -> int:
    """Run the class, and print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--users", type=int, default=30, help="the number of students")
    asked = parser.parse_args()
    console = Console()
    if lacking := real_hub.lacking():
        console.print(f"A real hub needs what this machine lacks: {lacking}", markup=False)
        return 2
    place = Path(tempfile.mkdtemp(prefix="hub-"))
    place.chmod(0o755)
    hub = Hub(place, [STUDENT.format(number) for number in range(1, asked.users + 1)], GRADER)
    term = Term(hub, lambda told: console.print(told, markup=False))
    try:
        hub.make_users()
        hub.set_up()
        hub.start()
        began = time.monotonic()
        try:
            term.run()
        except AssertionError:
            (place / "hub.log").replace(log := Path(tempfile.gettempdir()) / "whole_class_hub.log")
            console.print(f"The log of the hub and of the users' servers: {log}")
            raise
        minutes = (time.monotonic() - began) / 60
        console.print(table(term, minutes, (memory_of(GRADER), cpu_time_of(GRADER))))
        for name, seen in term.seen.items():
            if seen.others or seen.points != "5 of 5 points":
                console.print(f"{name}: {seen.points}; saw {sorted(seen.others) or 'nobody else'}", markup=False)
    finally:
        hub.remove()
        shutil.rmtree(place, ignore_errors=True)
    return int(any(one.others or one.points != "5 of 5 points" for one in term.seen.values()))


if __name__ == "__main__":
    raise SystemExit(main())
