"""A gradebook that cannot be used: it is found before anything runs, and is said as it is."""

from __future__ import annotations

import contextlib
import resource
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import toy
from typer.testing import CliRunner

from autograder.cli.main import app
from autograder.core.errors import KitError
from autograder.core.results import Isolation, SubmissionResult
from autograder.course.paths import CoursePaths
from autograder.gradebook.class_run import grade_class, try_class
from autograder.gradebook.grades import read_grades
from autograder.gradebook.release import register
from autograder.gradebook.settings import CONFIG_FILE
from autograder.grading.job import Job
from autograder.grading.runner import Settings


class Course:
    """A toy course, a class, and who of it was run."""

    def __init__(self, place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.root = toy.make_course(place / "course")
        self.paths = CoursePaths(self.root)
        self.class_ = place / "class"
        self.ran: list[str] = []

        def run(job: Job, *_: object) -> SubmissionResult:
            self.ran.append(job.student)
            return toy.judge(job)

        monkeypatch.setattr("autograder.grading.executors.local.run_in_worker", run)

    def hand_in(self, student: str) -> None:
        toy.hand_in(self.class_, student, toy.CELLS)

    def grade(self, run: Callable[..., object] = grade_class) -> None:
        run(self.root, toy.LAB, self.class_, Settings(Isolation.NONE, canaries=False))


@pytest.fixture
def course(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Course:
    """A course with the grades of a student, and another submission."""
    course = Course(tmp_path, monkeypatch)
    course.hand_in("ann")
    course.grade()
    course.ran.clear()
    course.hand_in("bob")
    return course


def test_a_locked_gradebook_is_found_before_anything_runs(course: Course) -> None:
    with contextlib.closing(sqlite3.connect(course.paths.gradebook, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")  # others may read
        with pytest.raises(Exception, match="database is locked"):
            course.grade()
    assert course.ran == []


def damage(course: Course) -> None:
    course.paths.gradebook.write_bytes(b"no database " * 100)


def unfinish(course: Course) -> None:
    with contextlib.closing(sqlite3.connect(course.paths.gradebook)) as gradebook:
        gradebook.execute("DELETE FROM alembic_version")
        gradebook.commit()


def renew(course: Course) -> None:
    with contextlib.closing(sqlite3.connect(course.paths.gradebook)) as gradebook:
        gradebook.execute("UPDATE alembic_version SET version_num = 'fedcba987654'")
        gradebook.commit()


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (damage, "is damaged: file is not a database"),
        (unfinish, "does not say which version it has"),
        (renew, "a newer one made it"),
    ],
)
def test_what_is_wrong_with_a_gradebook_is_said_before_anything_runs(
    course: Course, change: Callable[[Course], None], told: str
) -> None:
    change(course)
    for run in (grade_class, try_class) if change is damage else (grade_class,):
        with pytest.raises(KitError) as refused:
            course.grade(run)
        assert told in refused.value.what and "older" not in refused.value.what and course.ran == []
        assert change is renew or str(course.paths.gradebook.parent / "backups") in refused.value.do


@pytest.mark.parametrize("run", [grade_class, try_class])
def test_settings_that_are_not_known_to_be_yours_are_found_before_anything_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, run: Callable[..., object]
) -> None:
    course = Course(tmp_path, monkeypatch)
    course.hand_in("ann")
    (course.root / CONFIG_FILE).write_text("get_config()")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "nobody"))
    with pytest.raises(KitError, match="not known to be yours"):
        course.grade(run)
    assert course.ran == []


def test_settings_in_another_character_set_are_a_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    course = Course(tmp_path, monkeypatch)
    (course.root / CONFIG_FILE).write_bytes("name = 'Müller'\nget_config()\n".encode("latin-1"))
    with pytest.raises(KitError, match="cannot be used"):
        read_grades(course.root)


@contextlib.contextmanager
def full_disk(size: int) -> Iterator[None]:
    """Let no file of this process grow beyond so many bytes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_disk_that_fills_while_the_gradebook_is_made_leaves_none_that_is_half(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    course = Course(tmp_path, monkeypatch)
    for size in (20_000, 120_000):
        with full_disk(size), pytest.raises(Exception, match=r"disk I/O error|disk is full|malformed"):
            register(course.root, toy.LAB)
        assert not list(course.paths.gradebook.parent.glob("*.db"))
    course.hand_in("ann")
    course.grade()
    assert [grade.student for grade in read_grades(course.root)] == ["ann"]
    assert sorted(path.name for path in course.paths.gradebook.parent.iterdir()) == ["gradebook.db", "versions"]


def test_what_grading_would_change_is_found_out_without_changing_anything(course: Course) -> None:
    course.hand_in("cem")
    course.grade()
    (course.class_ / "ann" / "toy.ipynb").unlink()
    (course.class_ / "ann").rmdir()
    (course.class_ / "bob" / "toy.ipynb").write_text("{")
    (course.class_ / "dan.pdf").touch()
    before = files(course.root)
    options = ["--diff", "--accept", "smaller", "--isolation", "none", "--course", str(course.root)]
    done = CliRunner().invoke(app, ["grade", toy.LAB, str(course.class_), *options])
    assert done.exit_code == 3 and "Nothing was recorded" in done.output
    assert files(course.root) == before


def files(root: Path) -> dict[Path, bytes]:
    """What lies in a course, but for results that do not count."""
    folders = [root / "gradebook", *(root / "build" / name for name in ("submitted", "taken", "feedback", "results"))]
    return {path: path.read_bytes() for folder in folders for path in folder.rglob("*") if path.is_file()}
