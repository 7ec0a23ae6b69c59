"""Answers of past terms must still get their points, or somebody says why not, before a lab is released."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import by_hand
import pytest
import toy
from typer.testing import CliRunner

from autograder.authoring.bank import check as bank_check
from autograder.authoring.bank import explain, programs
from autograder.authoring.release import release
from autograder.cli.main import app
from autograder.core.errors import KitError
from autograder.core.results import Isolation, Outcome, Part, Status, SubmissionResult
from autograder.course.lab import load_lab
from autograder.gradebook.class_run import grade_class
from autograder.grading.job import Job
from autograder.grading.runner import Settings
from autograder.grading.trusted_result import too_busy


def run(root: Path, *arguments: str) -> tuple[int, str]:
    done = CliRunner().invoke(app, ["bank", *arguments, "--course", str(root)])
    return done.exit_code, done.output


def test_a_release_waits_until_every_difference_is_explained(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("autograder.grading.executors.local.run_in_worker", lambda job, *_: toy.judge(job))
    root = toy.make_course(tmp_path / "course")
    for student, talker in (("ann", "print('hello')"), ("bob", "print('no')"), ("cem", "print('hello')")):
        answers = {"talker": f"%%node talker\n{talker}", "answers": "%%file answers.yaml\nanswer: 42", "why": student}
        cells = load_lab(root, toy.LAB).clean_notebook(answers)["cells"]
        cells.append(toy.cell("code", "%%file more.yaml\nmine: 1", 99))
        toy.hand_in(tmp_path / "class", student, cells)
    grade_class(root, toy.LAB, tmp_path / "class", Settings(Isolation.NONE, canaries=False))
    by_hand.give(root, "bob", "check_talker", 3)
    release(root, toy.LAB)  # there is no bank yet
    with pytest.raises(KitError, match="The bank has no answers of toy"):
        bank_check(root, toy.LAB, Settings(Isolation.NONE))

    assert run(root, "add", toy.LAB) == (
        0,
        f"Added 2 entries to {root}/bank/toy.\nThe answers of 1 student are there already.\n",
    )
    texts = [path.read_text() for path in (root / "bank" / toy.LAB).glob("*.json")]
    assert not any(name in text for text in texts for name in ("ann", "bob", "cem"))
    assert all("mine: 1" in text for text in texts)
    with pytest.raises(KitError, match="was not run with today's version"):
        release(root, toy.LAB)

    status, said = run(root, "check", "--isolation", "none")
    entry = next(line.split()[1] for line in said.splitlines() if "check_talker: 3 → 0" in line)
    assert status == 1 and f"toy {entry} check_talker: 3 → 0: It says something else" in said  # no parts: by hand
    with pytest.raises(KitError, match="1 difference is unexplained in the bank of past terms"):
        release(root, toy.LAB)
    assert run(root, "show", toy.LAB, entry, "check_talker") == (0, "%%node talker\nprint('no')\n")
    with pytest.raises(KitError, match="toy has no check `talker`"):
        programs(root, toy.LAB, entry, "talker")
    with pytest.raises(KitError, match="The bank has no entry ann of toy"):
        programs(root, toy.LAB, "ann", "check_talker")
    with pytest.raises(KitError, match=f"found no difference of check_answers in '{entry}'"):
        explain(root, toy.LAB, entry, "check_answers", "It was too lenient.")
    assert run(root, "explain", toy.LAB, entry, "check_talker", "It was too lenient.")[0] == 0
    release(root, toy.LAB)
    assert run(root, "check", toy.LAB, "--isolation", "none")[0] == 0
    release(root, toy.LAB)

    notebook = root / "solutions" / toy.LAB / "toy.ipynb"
    notebook.write_text(notebook.read_text().replace("within=60", "within=50"))
    with pytest.raises(KitError, match="was not run with today's version"):
        release(root, toy.LAB)

    notebook.write_text(notebook.read_text().replace("check_answers", "check_table"))  # its points are nobody's now
    status, said = run(root, "check", toy.LAB, "--isolation", "none")
    assert status == 1 and said.count("check_answers: 2 → ?: It gives no result any more.") == 2
    with pytest.raises(KitError, match="2 differences are unexplained"):
        release(root, toy.LAB)
    status, said = run(root, "explain", toy.LAB, "all", "check_answers", "It has another name.")
    assert (status, said) == (0, "Explained 2 differences.\n")
    assert run(root, "check", toy.LAB, "--isolation", "none")[0] == 0

    path = root / "bank" / toy.LAB / f"{entry}.json"
    path.write_text(
        path.read_text()
        .replace('"check_talker":3.0', '"check_talker":null')
        .replace('"check_talker": 3.0', '"check_talker": null')
    )
    status, said = run(root, "check", toy.LAB, "--isolation", "none")
    assert status == 0 and "toy check_talker: not compared in 1 entry, because it had no points" in said
    assert "toy check_table: no entry has points of it, so the bank says nothing about this check." in said


def test_a_machine_that_is_too_busy_is_no_difference(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("autograder.grading.executors.local.run_in_worker", lambda job, *_: toy.judge(job))
    root = toy.make_course(tmp_path / "course")
    toy.hand_in(tmp_path / "class", "ann", load_lab(root, toy.LAB).clean_notebook({})["cells"])
    grade_class(root, toy.LAB, tmp_path / "class", Settings(Isolation.NONE, canaries=False))
    assert run(root, "add", toy.LAB)[0] == 0

    def busy(job: Job) -> SubmissionResult:
        told = toy.judge(job)
        told.checks[0] = too_busy(job.checks[0], 4.0)
        return told

    monkeypatch.setattr("autograder.grading.executors.local.run_in_worker", lambda job, *_: busy(job))
    status, said = run(root, "check", toy.LAB, "--isolation", "none")
    assert status == 1 and "0 differences" in said
    assert "toy check_talker: not decided in 1 entry, because the machine was too busy." in said
    with pytest.raises(KitError, match="the machine was too busy to run the whole bank"):
        release(root, toy.LAB)


class Judge:
    """A check of two parts, of which the second one fails, and of two expectations in the first one."""

    def __init__(self) -> None:
        self.parts = {"it starts": 1.5, "it says hello": 0.0}
        self.held = ["A node is there", "It has a timer"]
        self.code = "silent"

    def __call__(self, job: Job) -> SubmissionResult:
        told = toy.judge(job)
        parts = [Part(title=title, max_points=1.5, points=got) for title, got in self.parts.items()]
        outcomes = [Outcome(status=Status.PASSED, title=title, part="it starts") for title in self.held]
        outcomes.append(
            Outcome(
                status=Status.FAILED, title="It speaks", code=self.code, part="it says hello", because="It is silent."
            )
        )
        for check in told.checks:
            if check.grade_id == "check_talker":
                check.points, check.parts, check.outcomes = 1.5, parts, outcomes
        return told


@pytest.mark.parametrize(
    ("mistake", "told"),
    [
        (
            {"parts": {"it starts": 0.0, "it says hello": 1.5}},
            "part `it starts` 1.5 of 1.5 → 0 of 1.5; part `it says hello` 0 of 1.5 → 1.5 of 1.5: It is silent.",
        ),
        ({"parts": {"it starts": 1.5, "it says bye": 0.0}}, "part `it says hello` is gone; part `it says bye` is new"),
        ({"code": "late"}, "check_talker: reason of part `it says hello` `silent` → `late`: It is silent."),
        ({"held": ["A node is there"]}, "check_talker: expectations of part `it starts` 2 → 1: It is silent."),
    ],
)
def test_a_mistake_that_keeps_the_points_is_stopped(
    mistake: dict[str, Any], told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    judge = Judge()
    monkeypatch.setattr("autograder.grading.executors.local.run_in_worker", lambda job, *_: judge(job))
    root = toy.make_course(tmp_path / "course")
    toy.hand_in(tmp_path / "class", "ann", load_lab(root, toy.LAB).clean_notebook({})["cells"])
    grade_class(root, toy.LAB, tmp_path / "class", Settings(Isolation.NONE, canaries=False))
    assert run(root, "add", toy.LAB)[0] == 0
    assert run(root, "check", "--isolation", "none")[0] == 0

    judge.held.append(judge.held[-1])  # it asked once more, because the machine was busy
    assert run(root, "check", "--isolation", "none")[0] == 0
    vars(judge).update(mistake)
    status, said = run(root, "check", "--isolation", "none")
    assert status == 1 and told in said
    with pytest.raises(KitError, match="1 difference is unexplained"):
        release(root, toy.LAB)
    assert run(root, "explain", toy.LAB, "all", "check_talker", "It was wrong in the past.")[0] == 0
    assert run(root, "check", "--isolation", "none")[0] == 0
