"""Kills processes of a grading with SIGKILL at random moments, and looks whether anything is lost or left.

As a script: `python tests/support/kill_anything.py --times 300`. The random choices follow from `--seed`.
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import json
import os
import random
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import psutil
import toy
from places import ROOT

from autograder.core.results import SubmissionResult
from autograder.course.lab import load_lab
from autograder.course.paths import CoursePaths
from autograder.submission.reader import read_submission

MAIN = "import sys; sys.argv[0] = 'autograder'; from autograder.cli import main; main()"
STUDENTS = ("ann", "bob", "cem", "dan")
AFTER = 120.0
"""Seconds after which nothing may be left: far beyond what it takes on a busy machine."""


class Trials:
    """One course in which a class is graded and killed again and again.

    Args:
        folder: an empty one.
        seed: of the random choices.
    """

    def __init__(self, folder: Path, seed: int) -> None:
        """Make the course, and grade it once: that shows how long it takes."""
        self.random = random.Random(seed)
        self.scratch = folder / "tmp"
        self.scratch.mkdir()
        self.root = toy.make_course(folder / "course")
        self.paths = CoursePaths(self.root)
        self._hand_in(0)
        began = time.monotonic()
        self._complete()
        self.seconds = time.monotonic() - began

    def run(self, number: int) -> str:
        """Hand in, grade, kill, look, and grade to the end; returns what was killed, and when."""
        self._hand_in(number)
        shared = in_shared_memory()
        began = time.monotonic()
        process = self._start()
        moment = self.random.uniform(0, self.seconds)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(moment)
            self.seconds = time.monotonic() - began  # it had ended: the machine is less busy now
        family = [psutil.Process(process.pid)] if process.poll() is None else []
        with contextlib.suppress(psutil.NoSuchProcess):
            family += family[0].children(recursive=True) if family else []
        victims = self._victims(family)
        names = []
        for victim in victims:
            with contextlib.suppress(psutil.NoSuchProcess):
                names.append(victim.name())
                victim.kill()
        _, errors = process.communicate(timeout=300)
        assert "Traceback" not in errors, errors
        _, alive = psutil.wait_procs(family, timeout=AFTER)
        # One that has ended, and that the machine's init has not heard of, is not there.
        alive = [one for one in alive if one.is_running() and one.status() != psutil.STATUS_ZOMBIE]
        assert alive == [], f"still there: {alive}"
        self._nothing_is_left(shared)
        self._nothing_is_torn()
        finished = self._finished()
        self._complete()
        again = self._finished()
        assert set(again) == set(STUDENTS), again
        assert {who: again[who] for who in finished} == finished, "a finished result was not kept"
        with self.paths.grades.open() as file:
            scores = {row["student"]: (row["score"], row["waiting"]) for row in csv.DictReader(file)}
        assert scores == dict.fromkeys(STUDENTS, ("5", "1")), scores
        return f"after {moment:.1f} s: {', '.join(names) or 'nothing, it had ended'}; {len(finished)} were finished"

    def _victims(self, family: list[psutil.Process]) -> list[psutil.Process]:
        if not family:
            return []
        kind = self.random.choice(("the command", "one", "one", "several"))
        if kind == "the command":
            return family[:1]
        return self.random.sample(family, 1 if kind == "one" else self.random.randint(1, len(family)))

    def _hand_in(self, number: int) -> None:
        sources = {
            "talker": f"%%node talker\nprint('hello')  # {number}\n",
            "answers": "%%file answers.yaml\nanswer: 42",
        }
        cells = load_lab(self.root, toy.LAB).clean_notebook(sources | {"why": "So."})["cells"]
        for student in STUDENTS:
            toy.hand_in(self.root / "class", student, cells)

    def _start(self) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, "-c", MAIN, "grade", "toy", "class"],
            cwd=self.root, env=os.environ | {"PYTHONPATH": str(ROOT), "TMPDIR": str(self.scratch)}, text=True,
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True,
        )  # fmt: skip

    def _complete(self) -> None:
        process = self._start()
        _, errors = process.communicate(timeout=300)
        assert process.returncode == 0, errors
        assert not list(self.paths.build.rglob(".*.json.*")), "a file that was not finished is left after the next run"

    def _finished(self) -> dict[str, int]:
        """Of those that have a result of what was handed in last: since when."""
        lab, found = load_lab(self.root, toy.LAB), {}
        for student in STUDENTS:
            path = self.paths.results / toy.LAB / f"{student}.json"
            handed_in = read_submission(self.root / "class" / student / f"{toy.LAB}.ipynb", lab)
            if path.is_file() and SubmissionResult.load(path).digest == handed_in.digest:
                found[student] = path.stat().st_mtime_ns
        return found

    def _nothing_is_left(self, shared: set[str]) -> None:
        logs = self.scratch / f"autograder-log-{os.getuid()}"  # the user's one folder, which stays

        def left() -> list[str]:
            names = [str(path.relative_to(self.scratch)) for path in self.scratch.rglob("*") if path != logs]
            return names + sorted(in_shared_memory() - shared)

        deadline = time.monotonic() + AFTER
        while (found := left()) and time.monotonic() < deadline:
            time.sleep(0.05)
        assert not found, f"left in the folder for temporary files, or in shared memory: {found}"

    def _nothing_is_torn(self) -> None:
        for path in self.paths.results.rglob("[!.]*.json"):
            json.loads(path.read_text(encoding="utf-8"))
        for path in self.paths.feedback.rglob("*.html"):
            assert path.read_text(encoding="utf-8").rstrip().endswith("</html>"), path
        if self.paths.gradebook.is_file():
            with contextlib.closing(sqlite3.connect(self.paths.gradebook)) as gradebook:
                assert gradebook.execute("PRAGMA integrity_check").fetchone() == ("ok",)


def in_shared_memory() -> set[str]:
    """Names of what Python keeps there. What Fast DDS keeps lies in the sandboxes; outside it is somebody else's."""
    return {path.name for path in Path("/dev/shm").glob("*mp-*")}


def main() -> int:
    """Run the trials that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--seed", type=int, default=random.SystemRandom().getrandbits(32))
    asked = parser.parse_args()
    print(f"--seed {asked.seed}", flush=True)
    folder = Path(tempfile.mkdtemp(prefix="kills-"))
    trials = Trials(folder, asked.seed)
    for number in range(1, asked.times + 1):
        print(f"{number}/{asked.times} {trials.run(number)}", flush=True)
    shutil.rmtree(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
