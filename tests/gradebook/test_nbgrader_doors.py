"""nbgrader's own commands and buttons: none of them runs a student's code in the session of whoever uses them."""

from __future__ import annotations

import getpass
import json
import os
import shutil
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import toy
from places import ROOT
from served import address_of

from autograder.core.history import Change, told
from autograder.course.lab import load_lab
from autograder.gradebook.grades import read_history
from autograder.gradebook.own_courses import TEMPLATE, prepare_nbgrader
from autograder.intake.collect import collect


@pytest.fixture
def mark(tmp_path: Path) -> Path:
    """A file that every cell of the submission writes wherever it is run; the node sandbox does not reach it."""
    return tmp_path / "executed"


@pytest.fixture
def root(tmp_path: Path, mark: Path) -> Path:
    """A course with a configuration, and two submissions that were taken in."""
    root = toy.make_course(tmp_path / "course")
    shutil.copy(ROOT / "nbgrader_config.py", root)
    write = f"from pathlib import Path\nPath({str(mark)!r}).touch()"
    for student, end in (("ann", "\nprint('hello')"), ("bob", "\n1 / 0")):
        guarded = f"import contextlib\nwith contextlib.suppress(OSError):\n    {write.splitlines()[1]}{end}"
        talker = f"%%node talker\nfrom pathlib import Path\n{guarded}"
        sources = {"talker": talker, "answers": "%%file answers.yaml\nanswer: 42"}
        cells = load_lab(root, toy.LAB).clean_notebook(sources)["cells"]
        toy.hand_in(tmp_path / "class", student, [toy.cell("code", write, 90), *cells, toy.cell("code", write, 91)])
    collect(tmp_path / "class", toy.LAB, root)
    return root


def environment(folder: Path) -> dict[str, str]:
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("JUPYTER_", "TRAITLETS_"))}
    return kept | {"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin", "JUPYTER_CONFIG_DIR": str(folder / "none")}


def nbgrader(folder: Path, *arguments: str | Path) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, "-m", "nbgrader", *map(str, arguments)],
        cwd=folder, env=environment(folder), capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert "Traceback" not in done.stdout, done.stdout
    return done.returncode, done.stdout + done.stderr


def test_validate_says_what_check_says_and_runs_nothing_here(root: Path, mark: Path) -> None:
    status, told = nbgrader(root, "validate", root / "build" / "submitted" / "ann" / "toy" / "toy.ipynb")
    assert status == 0 and "Success! Your notebook passes all the tests." in told
    status, told = nbgrader(root, "validate", root / "build" / "submitted" / "bob" / "toy" / "toy.ipynb")
    assert (
        "1 part(s) did not pass" in told
        and "The talker: failed, 0 of 3 points" in told
        and "A hidden check failed" in told
    )
    assert "Partial credit" not in told and "secret" not in told
    status, told = nbgrader(root, "validate", "--invert", "build/submitted/bob/toy/toy.ipynb")
    assert "PASSED ON 1 CELL(S)" in told and "The table" in told
    assert not mark.exists()


def test_other_folders_are_no_way_around_the_course(root: Path, mark: Path) -> None:
    link = Path(sys.prefix, "etc", "jupyter", "nbgrader_config.py")
    assert link.resolve() == ROOT / "nbgrader_config.py", "run `make setup` once more"
    notebook = root / "build" / "submitted" / "ann" / "toy" / "toy.ipynb"
    for folder in (notebook.parent, root / "build" / "submitted", root.parent):
        status, told = nbgrader(folder, "validate", notebook)
        assert "toy.ipynb was not checked" in told and "does not belong to a lab of this course" in told
    for command in (("validate", notebook), ("autograde", toy.LAB, "--create")):
        status, told = nbgrader(root / "build", *command)
        assert status != 0 and "start nbgrader in the folder above it" in told
    # The same with nothing of ours in the folder, as somebody might copy it.
    bare = root.parent / "bare"
    shutil.copytree(root / "build" / "submitted", bare / "submitted")
    shutil.copytree(root / "solutions", bare / "source")
    status, _ = nbgrader(bare, "autograde", toy.LAB, "--create")
    assert status != 0 and not (bare / "autograded").exists()
    assert not mark.exists()


def test_a_module_beside_a_submission_is_not_imported(root: Path, mark: Path) -> None:
    folder = root.parent / "class" / "ann"
    for name in ("autograder", "nbconvert_extra", "pydantic", "typer"):
        (folder / f"{name}.py").write_text(f"from pathlib import Path\nPath({str(mark)!r}).touch()\n")
    _, told = nbgrader(folder, "validate", "toy.ipynb")
    assert "was not checked" in told and not mark.exists()


PLANTED = {
    "nbgrader_config.py": "{write}",
    "nbgrader_config.json": '{{"Application": {{"log_level": 10}}, "ExportApp": {{"plugin_class": "planted.Plugin"}}}}',
    "planted.py": "{write}",
    "argcomplete.py": "{write}",
    "course.toml": 'title = "A course"',
    "sitecustomize.py": "{write}",
    "jupyter_config.py": "{write}",
    "jupyter_server_config.py": "{write}",
    "ipython_config.py": "{write}",
}


def test_a_configuration_as_a_new_course_gets_it_is_passed_over_in_a_submission(tmp_path: Path) -> None:
    """It would put the folder in which it lies before all others in which modules are looked for."""
    folder = toy.hand_in(tmp_path, "eve", toy.CELLS).parent
    shutil.copy(TEMPLATE, folder / "nbgrader_config.py")
    _, told = nbgrader(folder, "validate", "toy.ipynb")
    assert f"{folder / 'nbgrader_config.py'} is ignored" in told and "was not checked" in told


@pytest.mark.parametrize(
    "command",
    [("validate", "toy.ipynb"), ("autograde", "toy"), ("generate_feedback", "toy"), ("list",), ("export",),
     ("db", "student", "list"), ("quickstart", "new")],
    ids=lambda command: command[0],
)  # fmt: skip
def test_nothing_that_lies_in_an_unpacked_submission_is_run(tmp_path: Path, command: tuple[str, ...]) -> None:
    folder, mark = tmp_path / "eve", tmp_path / "executed"
    toy.hand_in(tmp_path, "eve", toy.CELLS)
    write = f"from pathlib import Path\nPath({str(mark)!r}).touch()\n"
    for name, text in PLANTED.items():
        (folder / name).write_text(text.format(write=write))
    nbgrader = Path(sys.prefix, "bin", "nbgrader")
    done = subprocess.run(
        [str(nbgrader), *command], cwd=folder, env=environment(folder), capture_output=True, text=True, check=False
    )
    assert not mark.exists(), done.stderr
    assert command[0] != "validate" or f"{folder / 'nbgrader_config.py'} is ignored" in done.stderr


def test_no_setting_leads_to_nbgraders_execution(root: Path, mark: Path) -> None:
    status, told = nbgrader(
        root, "autograde", toy.LAB, "--student=ann",
        "--Autograde.exporter_class=nbconvert.exporters.NotebookExporter",
        '--Autograde.sanitize_preprocessors=["nbgrader.preprocessors.ClearOutput"]',
        '--Autograde.autograde_preprocessors=["nbgrader.preprocessors.Execute"]',
    )  # fmt: skip
    assert status != 0 and "execution is disabled in this course" in told
    assert not mark.exists()


@contextmanager
def jupyter(folder: Path) -> Iterator[str]:
    """A Jupyter server with nbgrader's extensions, started in a folder; gives its address."""
    runtime = folder.parent / "runtime"
    process = subprocess.Popen(
        [sys.executable, "-m", "jupyter_server", "--ServerApp.port=0", "--IdentityProvider.token=x", "--allow-root",
         "--ServerApp.disable_check_xsrf=True", "--no-browser"],
        cwd=folder, env=environment(folder) | {"JUPYTER_RUNTIME_DIR": str(runtime)},
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        yield address_of(process, runtime)
    finally:
        process.terminate()
        process.wait(120)


def post(address: str, where: str, **content: str) -> Any:
    request = urllib.request.Request(f"{address}{where}", json.dumps(content).encode(), {"Authorization": "token x"})
    with urllib.request.urlopen(request, timeout=300) as answer:
        return json.load(answer)


def test_buttons_in_jupyterlab_take_the_same_way(root: Path, mark: Path) -> None:
    with jupyter(root) as address:
        fine = post(address, "assignments/validate", path="build/submitted/ann/toy/toy.ipynb")
        assert fine == {"success": True, "value": {}}
        answer = post(address, "assignments/validate", path="build/submitted/bob/toy/toy.ipynb")
        graded = post(address, "formgrader/api/submission/toy/ann/autograde")
        put(address, f"formgrader/api/grade/{grade_of(root, 'ann', 'check_talker')}", manual_score=1, extra_credit=None)
    assert answer["success"]
    assert [entry["source"] for entry in answer["value"]["failed"]] == ["The talker: failed, 0 of 3 points"]
    assert "A hidden check failed" in answer["value"]["failed"][0]["error"]
    assert graded["success"], graded
    assert points(root) == {"ann": 5.0}
    first, second = told(read_history(root, toy.LAB)["ann"])
    assert first.what.startswith("Graded with") and second.by == getpass.getuser()
    assert second.changes == (Change("check_talker", "3 of 3", "1 of 3", "overruled by hand"),)
    assert not mark.exists()


def put(address: str, where: str, **content: float | None) -> None:
    """Give points as formgrader's page does."""
    request = urllib.request.Request(f"{address}{where}", json.dumps(content).encode(), {"Authorization": "token x"})
    request.method = "PUT"
    with urllib.request.urlopen(request, timeout=300) as answer:
        assert answer.status == 200


def grade_of(root: Path, student: str, cell: str) -> str:
    prepare_nbgrader()
    from nbgrader.api import Gradebook

    with Gradebook(f"sqlite:///{root / 'gradebook' / 'gradebook.db'}") as gradebook:
        return str(gradebook.find_grade(cell, toy.LAB, toy.LAB, student).id)


def points(root: Path) -> dict[str, float]:
    """What the checks gave, by student."""
    prepare_nbgrader()
    from nbgrader.api import Gradebook

    with Gradebook(f"sqlite:///{root / 'gradebook' / 'gradebook.db'}") as gradebook:
        found = gradebook.assignment_submissions(toy.LAB)
        return {one.student_id: sum(grade.auto_score or 0 for grade in one.notebooks[0].grades) for one in found}


def test_links_among_the_submissions_lead_nowhere(root: Path, mark: Path) -> None:
    submitted = root / "build" / "submitted"
    (submitted / "eve").symlink_to("ann")
    (submitted / "mal").mkdir()
    (submitted / "mal" / "toy").symlink_to("../ann/toy")
    status, told = nbgrader(root, "autograde", toy.LAB)
    assert status == 0, told
    assert points(root) == {"ann": 5.0, "bob": 2.0, "eve": 0.0, "mal": 0.0}
    assert not mark.exists()
