"""An export is never older than the grade: it renews a page, or says what has to be graded again."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import by_hand
import pytest
import toy
from typer.testing import CliRunner

from autograder.cli.main import app
from autograder.core.results import Isolation
from autograder.course.lab import load_lab
from autograder.course.paths import CoursePaths
from autograder.gradebook.class_run import grade_class
from autograder.grading.runner import Settings
from autograder.grading.store import ResultStore


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A course with a graded class of two, from Canvas."""
    monkeypatch.setattr("autograder.grading.executors.local.run_in_worker", lambda job, *_: toy.judge(job))
    root = toy.make_course(tmp_path / "course")
    sources = {"talker": "%%node talker\nprint('hello')", "answers": "%%file answers.yaml\nanswer: 42", "why": "So."}
    notebook = toy.hand_in(tmp_path, "x", load_lab(root, toy.LAB).clean_notebook(sources)["cells"]).read_bytes()
    (tmp_path / "class").mkdir()
    for student in ("annlee_11_111", "bobray_12_112"):
        (tmp_path / "class" / f"{student}_toy.ipynb").write_bytes(notebook)
    grade_class(root, toy.LAB, tmp_path / "class", Settings(Isolation.NONE, canaries=False))
    return root


def export(root: Path, form: str) -> tuple[int, dict[str, str], str]:
    """Return the exit status, the files of the zip or the one table, and what is said."""
    out = root / "out"
    done = CliRunner().invoke(app, ["export", form, "--course", str(root), "--lab", toy.LAB, "-o", str(out)])
    if not out.is_file():
        return done.exit_code, {}, done.stderr
    content = out.read_bytes()
    if not content.startswith(b"PK"):
        return done.exit_code, {"": content.decode()}, done.stderr
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return done.exit_code, {name: archive.read(name).decode() for name in archive.namelist()}, done.stderr


def test_the_page_in_the_zip_shows_the_points_of_the_table(root: Path) -> None:
    done = CliRunner().invoke(app, ["export", "canvas", "--course", str(root), "-o", str(root / "out")])
    assert done.stdout == f"{root / 'out'} holds 2 students of {toy.LAB}.\n"
    status, pages, said = export(root, "canvas-feedback")
    assert status == 0 and "5 of 9 points so far" in pages["annlee_11_111_toy.html"]
    assert "In the roster" not in said
    (root / "roster.csv").write_text("id,name\nannlee,Ann Lee\nbobray,Bob Ray\ncem,Cem Su\n")
    status, pages, said = export(root, "canvas-feedback")
    assert status == 0 and "In the roster, but nothing was graded: cem." in said
    assert CliRunner().invoke(app, ["report", "--course", str(root)]).exit_code == 0
    assert "In the roster, but nothing was graded: cem." in CoursePaths(root).class_page(toy.LAB).read_text()
    assert "Not graded yet and counted as 0: 2 answers in words in 2 of 2 submissions." in said
    by_hand.give(root, "annlee", "why", 3.5, "Well said.")
    assert ",8.5\n" in export(root, "canvas")[1][""]
    status, pages, said = export(root, "canvas-feedback")
    page = pages["annlee_11_111_toy.html"]
    assert status == 0 and "8.5 of 9 points" in page and "not graded yet" not in page and "Well said." in page
    assert "5 of 9 points so far" in pages["bobray_12_112_toy.html"]
    assert "1 of 2 submissions" in said and "annlee,toy,8.5,9,0" in CoursePaths(root).grades.read_text()


def test_what_cannot_be_renewed_is_refused_with_a_sentence(root: Path) -> None:
    store = ResultStore(root)
    result = store.last(toy.LAB, "annlee")
    assert result is not None
    store.save(result.model_copy(update={"seed": result.seed + 1}))  # as after a run that was not recorded
    for form in ("canvas", "canvas-feedback"):
        status, files, said = export(root, form)
        assert status == 3 and "annlee: the result, the grade and the feedback page do not belong together" in said
        assert not any("annlee" in text for text in (*files, *files.values()))
        assert "bobray" in "".join((*files, *files.values()))


def test_a_lab_that_changed_after_grading_does_not_hold_up_an_export(root: Path) -> None:
    notebook = root / "solutions" / toy.LAB / f"{toy.LAB}.ipynb"
    notebook.write_text(notebook.read_text().replace("A toy lab", "A lab"))
    assert export(root, "canvas-feedback")[0] == 0
    by_hand.give(root, "annlee", "why", 3.5)
    status, _, said = export(root, "canvas-feedback")
    assert status == 3 and "run autograder grade toy SUBMISSIONS again" in said


def test_a_page_keeps_its_reports_if_it_is_renewed_with_another_version_of_the_kit(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = CoursePaths(root).feedback_page("annlee", toy.LAB)
    assert "3 of 3 points" in page.read_text()
    monkeypatch.setattr("autograder.course.lab.kit_digest", lambda: "another")
    (root / "solutions" / toy.LAB / f"{toy.LAB}.ipynb").touch()  # so that the lab is read again
    by_hand.give(root, "annlee", "why", 3.5, "Well said.")
    assert export(root, "canvas-feedback")[0] == 0
    assert "Well said." in page.read_text() and "3 of 3 points" in page.read_text()
