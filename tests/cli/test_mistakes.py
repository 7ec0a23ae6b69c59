"""What somebody reads who types a command slightly wrong, or whose files are not where they were."""

from __future__ import annotations

import os
import shlex
import stat
import subprocess
import sys
import zipfile
from pathlib import Path

import forked_command
import pytest
import toy
from places import ROOT

from autograder.authoring.gradescope import write_gradescope
from autograder.core.errors import KitError
from autograder.core.files import only_one
from autograder.core.results import Isolation, SubmissionResult
from autograder.course.lab import load_lab
from autograder.course.paths import CoursePaths
from autograder.gradebook.database import make_usable
from autograder.grading.store import ResultStore

ANSWERS = {"talker": "%%node talker\nprint('hello')", "answers": "%%file answers.yaml\nanswer: 42", "why": "So."}
JANE = "Jane Doe"


def told(root: Path, *words: str) -> str:
    """Return what a command says that refuses something."""
    done = forked_command.run(root, *words)
    assert done.returncode == 2 and "Traceback" not in done.stderr and "defect" not in done.stderr, done
    return " ".join(done.stderr.split())


@pytest.fixture
def root(tmp_path: Path) -> Path:
    return toy.make_course(tmp_path / "course")


def graded(root: Path, lab: str = toy.LAB) -> None:
    """Store a result of one student, whose name has a space in it."""
    ResultStore(root).save(
        SubmissionResult(student=JANE, lab=lab, digest="d", isolation=Isolation.NONE, seed=7, checks=[])
    )


@pytest.mark.parametrize(
    "words",
    [
        ("report",),
        ("term",),
        ("export", "csv"),
        ("similar", toy.LAB),
        ("answers", toy.LAB, "why"),
        ("viva", "--sample", "5"),
        ("explain", "ann"),
    ],
)
def test_before_a_class_is_graded_a_command_names_the_one_that_grades_it(root: Path, words: tuple[str, ...]) -> None:
    assert "autograder grade" in (said := told(root, *words)) and "SUBMISSIONS" in said


@pytest.mark.parametrize(
    "words",
    [
        ("grade", "toi"),
        ("grade", "toi", "nowhere"),
        ("explain", JANE, "--lab", "toi"),
        ("explain", JANE, "--lab", "."),
        ("explain", JANE, "--lab", "/labs/toy"),
        ("viva", "--sample", "5", "--lab", "toi"),
    ],
)
def test_a_lab_that_is_misspelt_is_named_with_those_that_there_are(root: Path, words: tuple[str, ...]) -> None:
    graded(root)
    assert f"This course has no lab `{words[-1] if words[0] != 'grade' else 'toi'}`. Labs in {root}: toy." in told(
        root, *words
    )


def test_make_grade_with_a_lab_that_is_misspelt_says_so_too() -> None:
    script = ROOT / "tests" / "support" / "sample_class.py"
    done = subprocess.run([sys.executable, str(script), "lab2"], capture_output=True, text=True, check=False)
    assert done.returncode != 0 and done.stderr.startswith("error: This course has no lab `lab2`.\n  Labs in ")


def test_a_course_of_ones_own_is_not_told_to_build_a_sample_class(root: Path) -> None:
    assert told(root, "grade", toy.LAB).endswith("Name a folder or zip.")


def test_an_answer_cell_that_became_text_is_told_when_it_is_handed_in(root: Path) -> None:
    cells = load_lab(root, toy.LAB).clean_notebook(ANSWERS)["cells"]
    for cell in cells:
        if cell["metadata"].get("nbgrader", {}).get("grade_id") == "talker":
            cell["cell_type"] = "markdown"
            del cell["outputs"], cell["execution_count"]
    notebook = toy.hand_in(root / "work", "ann", cells)
    done = forked_command.run(root, "submit", str(notebook), "--course", ".", "--without-checks", "-o", "out")
    assert done.returncode == 0 and "no longer a code cell" in " ".join(done.stdout.split()), done
    assert (root / "out" / "toy.receipt.txt").is_file()


def test_submit_replaces_its_own_copy_and_no_other_notebook(root: Path) -> None:
    folder = toy.hand_in(root, "work", load_lab(root, toy.LAB).clean_notebook(ANSWERS)["cells"]).parent
    original, copy = folder / "toy.ipynb", folder / "toy-Copy1.ipynb"
    copy.write_text(original.read_text().replace("hello", "good day"))
    command = ("submit", "--course", str(root), "--without-checks", "--lab", toy.LAB)
    assert "is another notebook" in told(folder, *command, copy.name, "-o", ".") and "hello" in original.read_text()
    for notebook in (copy, original):
        assert forked_command.run(folder, *command, notebook.name, "-o", "out").returncode == 0
    assert (folder / "out" / "toy.ipynb").read_bytes() == original.read_bytes()
    assert forked_command.run(folder, *command, original.name, "-o", ".").returncode == 0


def test_gradescopes_zip_of_a_class_is_not_replaced(root: Path) -> None:
    submissions = root / "submissions.zip"
    with zipfile.ZipFile(submissions, "w") as archive:
        archive.writestr("submission_1/toy.ipynb", "{}")
    before = submissions.read_bytes()
    assert "is no autograder for Gradescope" in told(root, "gradescope", toy.LAB, str(submissions))
    assert submissions.read_bytes() == before
    made = write_gradescope(root, toy.LAB, root / "autograder.zip")
    assert write_gradescope(root, toy.LAB, made) == made


def test_a_weight_of_no_lab_is_told_and_a_negative_one_is_refused(root: Path) -> None:
    graded(root)
    (root / "course.toml").write_text("[weights]\ntoi = 2\n")
    done = forked_command.run(root, "term")
    assert done.returncode == 0 and "course.toml gives a weight to `toi`, which is no lab" in done.stderr
    assert "gives a weight to the lab `toi`, which does not exist" in forked_command.run(root, "lint").stdout
    (root / "course.toml").write_text("[weights]\ntoy = -2\n")
    assert "weights" in told(root, "term")


def test_a_term_whose_labs_have_all_gone_is_a_sentence(root: Path) -> None:
    graded(root, "toy_old")
    assert "is in the course any more: toy_old. Labs in" in told(root, "term")


def test_a_command_that_is_told_can_be_typed(root: Path) -> None:
    graded(root)
    done = forked_command.run(root, "explain", JANE)
    command = next(line for line in done.stdout.splitlines() if "autograder explain" in line).partition("autograder ")[
        2
    ]
    assert shlex.split(command)[:2] == ["explain", JANE], done


def test_two_graders_with_a_group_may_both_write(tmp_path: Path) -> None:
    """With the umask that they have set, what the first one makes is writable for the second one's group."""
    root = toy.make_course(tmp_path / "course")
    before = os.umask(0o002)
    try:
        with only_one(CoursePaths(root).lock, "autograder grade"):
            pass
        make_usable(root)
    finally:
        os.umask(before)
    made = [path for path in root.rglob("*") if path.name in ("grading.lock", "gradebook.db")]
    assert len(made) == 2 and all(stat.S_IMODE(path.stat().st_mode) == 0o664 for path in made)


def test_a_renamed_notebook_that_is_none_is_told_why_it_cannot_be_read(root: Path) -> None:
    (root / "my lab (1).ipynb").write_text('{"cells": [')
    assert "is not valid JSON" in told(root, "check", "--course", ".", "my lab (1).ipynb")


@pytest.mark.parametrize("domain", ["abc", "233", "-1"])
def test_a_domain_that_does_not_exist_is_a_sentence(tmp_path: Path, domain: str) -> None:
    command = [str(Path(sys.executable).with_name("ros2")), "node", "list"]
    environment = {**os.environ, "ROS_DOMAIN_ID": domain}
    done = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2 and done.stderr.startswith(f"error: ROS_DOMAIN_ID is '{domain}'."), done


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--points", "2"), "`--points` says how many points are granted."),
        (("--refuse", "--points", "2", "--reason", "No."), "`--points` says how many points are granted."),
        (("--reason", "Yes."), "`--reason` belongs to an answer."),
    ],
)
def test_an_answer_to_an_appeal_is_never_dropped(root: Path, more: tuple[str, ...], said: str) -> None:
    notebook = toy.hand_in(root / "class", "ann", load_lab(root, toy.LAB).clean_notebook(ANSWERS)["cells"])
    words = ("appeal", str(notebook), "check_answers", "It is right.", "-o", "a.appeal.json", "--course", ".")
    assert forked_command.run(root, *words).returncode == 0
    assert said in told(root, "replay", "a.appeal.json", "--times", "0", *more)


def test_a_name_that_is_too_long_and_a_seed_below_0_are_refused_before_the_check_runs(root: Path) -> None:
    notebook = toy.hand_in(root / "class", "ann", load_lab(root, toy.LAB).clean_notebook(ANSWERS)["cells"])
    words = ("appeal", str(notebook), "check_answers", "It is right.", "--course", ".")
    assert "The name has 201 characters." in told(root, *words, "--name", "n" * 201)
    assert "--seed" in told(root, *words, "--seed", "-1")


def test_requirements_in_another_encoding_are_a_sentence(tmp_path: Path) -> None:
    from autograder.authoring.requirements import read

    path = tmp_path / "requirements.yaml"
    path.write_bytes("requirements: [{text: Schön, check: c}]".encode("latin-1"))
    with pytest.raises(KitError, match="cannot be read"):
        read(path)
