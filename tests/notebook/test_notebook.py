"""A student's notebook: the cell magics, the files they write, and what a cell shows, in real kernels."""

from __future__ import annotations

import hashlib
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from pathlib import Path
from typing import Any

import pytest
from IPython.core.interactiveshell import InteractiveShell
from jupyter_server.services.contents.fileio import atomic_writing
from kernels import SET_UP, START, TALKER, Notebook
from places import ROOT

import autograder.checks
from autograder.core import front_end, interrupts
from autograder.course.cells import blank_mark, parse
from autograder.notebook import hints
from autograder.notebook.kernel import NO_VERDICT, Kernel
from autograder.notebook.program_folder import MANIFEST
from autograder.notebook.saved_notebook import SavedNotebook
from autograder.submission.copies import SPLIT, told_of_copies, told_of_given_copies

CHECK = 'with launch("talker") as ros:\n    ros.topic("/chatter", String).expect_messages(at_least=2)\nros.score(2)'


# The magics, in a shell of this process.


@pytest.fixture
def shell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[InteractiveShell]:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lab.ipynb").write_text("{}")
    monkeypatch.setenv("JPY_SESSION_NAME", str(tmp_path / "lab.ipynb"))
    InteractiveShell.clear_instance()
    shell = InteractiveShell.instance()
    shell.run_line_magic("load_ext", "autograder")
    yield shell
    assert front_end.active is not None
    front_end.active.ready()
    front_end.active = None
    InteractiveShell.clear_instance()


def say(shell: InteractiveShell, cell: str, capsys: pytest.CaptureFixture[str]) -> str:
    assert shell.run_cell(cell, store_history=True).success
    return capsys.readouterr().out.strip()


def folder() -> Path:
    return Path("nodes/lab")


def test_a_node_cell_becomes_a_program(shell: InteractiveShell, capsys: pytest.CaptureFixture[str]) -> None:
    said = say(shell, "\n%%node talker\nprint('hello')\n", capsys)
    assert said == "node program talker written (nodes/lab/talker.py)"
    # The lines have the numbers that they have in the cell.
    assert (folder() / "talker.py").read_text() == "\n# %%node talker\nprint('hello')\n"
    assert "talker" not in shell.user_ns


@pytest.mark.parametrize(
    ("cell", "text"),
    [
        ("    %%node talker\n    if 1:\n        print(1)\n", "# %%node talker\nif 1:\n    print(1)\n"),
        ("%%time\n%%node talker\nprint(1)\n", "\n# %%node talker\nprint(1)\n"),
    ],
)
def test_a_program_has_the_lines_of_its_cell_whatever_the_magic_stands_in(
    shell: InteractiveShell, capsys: pytest.CaptureFixture[str], cell: str, text: str
) -> None:
    assert "node program talker written" in say(shell, cell, capsys)
    assert (folder() / "talker.py").read_text() == text
    # What the notebook takes indented, grading takes; a cell that begins with another magic it does not.
    graded = parse(cell)
    assert graded is None if "time" in cell else graded is not None and graded.text == text


def test_a_file_cell_becomes_a_file(shell: InteractiveShell, capsys: pytest.CaptureFixture[str]) -> None:
    assert say(shell, "%%file camera.yaml\na: 1\n", capsys) == "file camera.yaml written (nodes/lab/camera.yaml)"
    assert (folder() / "camera.yaml").read_text() == "a: 1\n"


@pytest.mark.parametrize("cell", ["%%file src/car/resource/car", "%%file src/car/resource/car\n"])
def test_a_file_cell_without_a_line_below_is_an_empty_file_as_at_grading(
    shell: InteractiveShell, capsys: pytest.CaptureFixture[str], cell: str
) -> None:
    graded = parse(cell)
    assert graded is not None
    assert f"file {graded.name} written" in say(shell, cell, capsys)
    assert (folder() / graded.name).read_text() == graded.text == graded.text.strip()


@pytest.mark.parametrize(
    ("cell", "line"),
    [
        ("%%node talker\nx = 1\ndef f(:\n    pass\n", "line 3 of the cell is not Python"),
        ("%%file a.yaml\na: 1\nb: [\n", "line 4 of the cell is not YAML"),
        ('%%file a.json\n{"a": 1,\n"b" 2}\n', "line 3 of the cell is not JSON"),
    ],
)
def test_a_defect_is_told_at_once_with_its_line(
    shell: InteractiveShell, capsys: pytest.CaptureFixture[str], cell: str, line: str
) -> None:
    assert line in say(shell, cell, capsys)
    # Written all the same: running it shows the same error that grading shows.
    assert len([path for path in folder().iterdir() if path.name != MANIFEST]) == 1


@pytest.mark.parametrize(
    ("cell", "why"),
    [
        ("%%node ../x\n1\n", "cannot name a program"),
        ("%%node\n1\n", "needs a name"),
        ("%%file a.txt\n1\n", "cannot name a file"),
        ("%%file my_main.py\n1\n", "is written with `%%node my_main`"),
        ("%%file A.py\n1\n", "cannot name a file"),
        ("%%node X\n1\n", "cannot name a program"),
        ("%%node rclpy\n1\n", "the name of an installed module"),
        ("%%node json\n1\n", "the name of an installed module"),
    ],
)
def test_a_bad_name_writes_nothing_and_is_explained(
    shell: InteractiveShell, capsys: pytest.CaptureFixture[str], cell: str, why: str
) -> None:
    said = say(shell, cell, capsys)
    assert "not written" in said and why in said
    assert not Path("nodes").exists()


def test_what_the_disk_refuses_is_named_with_what_to_do(
    shell: InteractiveShell, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("nodes").write_text("a file, where a folder has to be")
    said = say(shell, "%%node talker\nprint('hello')\n", capsys)
    assert "✗ not written: " in said and "nodes" in said and "run the cell again" in said


def test_the_magics_explain_themselves(shell: InteractiveShell) -> None:
    for magic, example in (("node", "%%node talker"), ("file", "%%file camera.yaml")):
        text = shell.find_cell_magic(magic).__doc__
        assert example in text and "nodes" in text


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("%%no", "%%node"),
        ("%%fi", "%%file"),
        ('with launch("ta', "talker"),
        ('launch("other", "ta', "talker"),
        ("%ros2 to", "topic"),
        ("%ros2 topic ec", "echo"),
    ],
)
def test_the_tab_key_offers_magics_programs_and_the_words_of_ros2(
    shell: InteractiveShell, line: str, offered: str
) -> None:
    shell.run_cell("%%node talker\nprint('hello')\n")
    assert offered in shell.complete("", line, len(line))[1]


def test_each_cell_begins_with_no_findings(shell: InteractiveShell) -> None:
    from autograder.checks import current
    from autograder.core.results import Outcome, Status

    current.check.findings.outcomes.append(Outcome(status=Status.PASSED, title="left over"))
    shell.run_cell("1")
    assert current.check.findings.outcomes == []


def new_kernel(shell: InteractiveShell, manifest: Path | None) -> Kernel:
    """What a new kernel finds: the manifest is of one that has ended."""
    if manifest is not None:
        content = json.loads(manifest.read_text())
        manifest.write_text(json.dumps(content | {"kernel": {"pid": 1, "start": "0"}}))
    return Kernel(shell)


def test_a_new_kernel_knows_no_program_of_the_last_one(shell: InteractiveShell) -> None:
    shell.run_cell("%%node talker\nprint('hello')\n")
    found = new_kernel(shell, folder() / MANIFEST)
    assert not (folder() / "talker.py").exists() and not found.has("talker.py")


def test_the_programs_stay_when_the_extension_is_loaded_again(shell: InteractiveShell) -> None:
    shell.run_cell("%%node talker\nprint('hello')\n")
    shell.run_line_magic("reload_ext", "autograder")
    assert front_end.active is not None and front_end.active.has("talker.py")
    assert shell.events.callbacks["pre_run_cell"].count(front_end.active.begin_cell) == 1


def test_nothing_is_deleted_that_no_cell_wrote(shell: InteractiveShell) -> None:
    own = [Path("nodes") / name for name in ("my_robot.py", "params.yaml", "data.csv")]
    own += [folder() / name for name in ("helper.py", "notes.txt", "mine.yaml")]
    shell.run_cell("%%node talker\nprint('hello')\n")
    for path in own:
        path.write_text("my own\n")
    new_kernel(shell, folder() / MANIFEST)
    assert [path.read_text() for path in own] == ["my own\n"] * len(own)


def test_a_file_that_was_changed_by_hand_is_kept_and_does_not_count(shell: InteractiveShell) -> None:
    shell.run_cell("%%node talker\nprint('hello')\n")
    (folder() / "talker.py").write_text("print('changed by hand')\n")
    found = new_kernel(shell, folder() / MANIFEST)
    assert not found.has("talker.py") and not (folder() / "talker.py").exists()
    assert (folder() / "talker.py.mine").read_text() == "print('changed by hand')\n"
    assert found.folder.kept == [
        "nodes/lab/talker.py was not what a cell had written: your file is kept as nodes/lab/talker.py.mine"
    ]


def test_what_a_cell_wrote_is_kept_once_no_cell_has_it(shell: InteractiveShell) -> None:
    cells = [{"cell_type": "code", "id": "a", "source": "%%node talker\n1\n", "metadata": {}, "outputs": []}]
    Path("lab.ipynb").write_text(json.dumps({"cells": cells, "metadata": {}, "nbformat": 4, "nbformat_minor": 5}))
    for name in ("talker", "listener"):  # the cell of the second has been deleted, or was never saved
        shell.run_cell(f"%%node {name}\n1\n", store_history=True)
    kept = Kernel(shell).folder.kept
    assert [path.name for path in folder().glob("*er.py*")] == ["listener.py.mine"]
    assert len(kept) == 1 and "listener.py has no cell in the saved notebook" in kept[0]


def test_a_students_own_file_is_never_overwritten(shell: InteractiveShell, capsys: pytest.CaptureFixture[str]) -> None:
    folder().mkdir(parents=True)
    for number in (1, 2):
        (folder() / "talker.py").write_text(f"print('my own {number}')\n")
        said = say(shell, f"%%node talker\nprint('from the cell {number}')\n", capsys)
        kept = f"talker.py.mine{'' if number == 1 else 2}"
        assert f"your file is kept as nodes/lab/{kept}" in said
        assert (folder() / kept).read_text() == f"print('my own {number}')\n"
    assert "from the cell 2" in (folder() / "talker.py").read_text()


def test_two_notebooks_of_one_folder_do_not_meet(shell: InteractiveShell, monkeypatch: pytest.MonkeyPatch) -> None:
    shell.run_cell("%%node talker\nprint('hello')\n")
    Path("other.ipynb").write_text("{}")
    monkeypatch.setenv("JPY_SESSION_NAME", str(Path("other.ipynb").resolve()))
    other = Kernel(shell)
    assert other.folder.path.name == "other" and not other.has("talker.py")
    assert (folder() / "talker.py").is_file()


def test_visual_studio_code_says_which_notebook_it_is(shell: InteractiveShell, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("JPY_SESSION_NAME")
    shell.user_ns["__vsc_ipynb_file__"] = str(Path("lab.ipynb").resolve())
    assert Kernel(shell).folder.path.name == "lab"


def test_a_second_kernel_of_a_notebook_does_not_touch_the_first(shell: InteractiveShell) -> None:
    shell.run_cell("%%node talker\nprint('hello')\n")
    manifest = folder() / MANIFEST
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as other:
        start = Path(f"/proc/{other.pid}/stat").read_text().rpartition(")")[2].split()[19]
        owner = {"kernel": {"pid": other.pid, "start": start}}
        manifest.write_text(json.dumps(json.loads(manifest.read_text()) | owner))
        assert Kernel(shell).folder.path.name == "lab-2"
        assert (folder() / "talker.py").is_file()
        other.kill()


def test_without_a_notebook_the_kernel_leaves_nothing_behind(
    shell: InteractiveShell, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("JPY_SESSION_NAME")
    front_end.active.ready()
    front_end.active = None
    shell.run_line_magic("reload_ext", "autograder")
    assert say(shell, "%%node talker\nprint('hello')\n", capsys) == "node program talker written"
    front_end.active.folder.close()
    assert not Path("nodes").exists()


# Kernels as a front end drives them.


@pytest.fixture(scope="module")
def notebook(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Notebook]:
    """A notebook whose set-up cell and talker have been run, and saved."""
    made = Notebook(tmp_path_factory.mktemp("notebook"))
    made.run(SET_UP)
    yield made
    made.close()


def answer(source: str, grade_id: str = "talker", blank: str = "") -> tuple[str, str, dict[str, Any]]:
    marks = {
        "grade_id": grade_id,
        "solution": True,
        "grade": False,
        "locked": False,
        "task": False,
        "schema_version": 3,
    }
    return grade_id, source, {"nbgrader": marks, "autograder": blank_mark(blank)}


def write(notebook: Notebook, source: str = TALKER) -> int:
    """Save and run the cell; gives its number."""
    notebook.save(answer(source))
    shown = notebook.run(source, "talker")
    assert "written" in shown.text
    return shown.number


def test_a_score_reads_as_a_report_in_every_front_end(notebook: Notebook) -> None:
    write(notebook)
    shown = notebook.run(CHECK, "check")
    assert shown.result.startswith("✓ passed  2 of 2 points\n") and "<div" in shown.html
    assert shown.types.count("execute_result") == 1


def test_nbgrader_still_reads_the_points(tmp_path: Path) -> None:
    from nbformat.v4 import new_code_cell, new_output
    from nbgrader.utils import determine_grade

    made = Notebook(tmp_path, NBGRADER_EXECUTION="autograde")
    try:
        made.run(SET_UP)
        made.run("%%node talker\nprint('no node')")
        plain = made.run(CHECK).result
    finally:
        made.close()
    cell = new_code_cell(outputs=[new_output("execute_result", {"text/plain": plain}, execution_count=1)])
    cell.metadata["nbgrader"] = {"grade": True, "solution": False, "points": 2, "grade_id": "check"}
    assert determine_grade(cell) == (0, 2)


def test_a_report_names_the_cell_and_the_time(notebook: Notebook) -> None:
    number = write(notebook)
    shown = notebook.run(CHECK)
    assert f"`talker` from cell [{number}], run at " in shown.text
    assert "not saved" not in shown.text and "!" not in shown.text


def test_a_cell_that_was_changed_after_its_run_is_named(notebook: Notebook) -> None:
    write(notebook)
    notebook.save(answer(TALKER.replace("0.05", "0.06")))
    assert "The cell `%%node talker` has been changed since it was run" in notebook.run(CHECK).text


def test_a_cell_that_is_not_saved_yet_is_marked(notebook: Notebook) -> None:
    write(notebook)
    notebook.run(TALKER.replace("0.05", "0.06"), "talker")
    shown = notebook.run(CHECK).text
    assert ", not saved yet" in shown and "has been changed" not in shown


def test_a_program_from_a_cell_that_grading_ignores_is_named(notebook: Notebook) -> None:
    notebook.save(answer("%%node talker\n# YOUR CODE HERE"), ("a-new-cell", "%%node talker\n", {}))
    notebook.run(TALKER, "a-new-cell")
    shown = " ".join(notebook.run(CHECK).text.split())
    assert "was written by a cell of your own" in shown and "Grading ignores that cell" in shown


def test_copies_of_an_answer_cell_are_told_as_grading_counts_them(notebook: Notebook) -> None:
    """A copy takes the grading mark along, and another id; the notebook on disk hears of it when it is saved."""
    earlier = TALKER.replace("0.05", "0.06")
    copied = told_of_copies("%%node talker", 2)
    own, copy = answer(earlier), ("copy", TALKER, answer(TALKER)[2])
    notebook.save(own)
    number = notebook.run(TALKER, "copy").number
    shown = " ".join(notebook.run(CHECK).text.split())
    assert f"was written by cell [{number}], which is not in the saved notebook" in shown and "of your own" not in shown
    for order, ran, counts in (
        ((own, copy), copy, True),
        ((own, copy), own, False),
        ((copy, own), copy, False),
        ((copy, own), own, True),
    ):
        notebook.save(*order)
        identity, source, _ = ran
        number = notebook.run(source, identity).number
        for shown in (notebook.run(CHECK).text, notebook.run("%lab").text):
            flowing = " ".join(shown.split())
            assert flowing.count(copied) == 1 and "Move your text" not in flowing
            assert (f"This report is about another one, cell [{number}]" in flowing) is not counts


def said(notebook: Notebook) -> list[str]:
    """What the check and `%lab` say, on one line."""
    return [" ".join(notebook.run(cell).text.split()) for cell in (CHECK, "%lab")]


FILES = {"talker": "talker.py", "listener": "listener.py"}


def test_a_copy_with_the_name_of_another_answer_is_told(notebook: Notebook) -> None:
    listener = answer("%%node listener\n# YOUR CODE HERE", "listener")
    mine = ("copy", TALKER.replace("%%node talker", "%%node listener"), answer(TALKER)[2])
    notebook.save(answer(TALKER), listener, mine, answers=FILES)
    notebook.run(TALKER, "talker")
    number = notebook.run(mine[1], "copy").number
    for shown in (" ".join(notebook.run(CHECK.replace("talker", "listener")).text.split()), said(notebook)[1]):
        assert f"`listener` was written by a cell of your own, cell [{number}]. Grading ignores that cell" in shown
    notebook.run(listener[1], "listener")


@pytest.mark.parametrize(
    ("cells", "expected"),
    [
        ([("talker", "", answer("")[2])], "The cell for this answer, `talker`, no longer begins with `%%node talker`"),
        ([], "The lab's cell for this answer, `talker`, was deleted"),
    ],
)
def test_an_answer_that_was_moved_out_of_the_labs_cell_is_told(
    notebook: Notebook, cells: list[tuple[str, str, dict[str, Any]]], expected: str
) -> None:
    notebook.save(*cells, ("mine", TALKER, {}), answers=FILES)
    notebook.run(TALKER, "mine")
    for shown in said(notebook):
        assert expected in shown


def test_an_answer_that_is_no_code_cell_any_more_is_told(notebook: Notebook) -> None:
    notebook.run(TALKER, "talker")
    notebook.save(answer(TALKER), answers=FILES)
    content = json.loads(notebook.path.read_text())
    content["cells"][0]["cell_type"] = "markdown"
    notebook.path.write_text(json.dumps(content))
    for shown in said(notebook):
        assert "The cell for this answer, `talker`, is no longer a code cell" in shown


def test_a_copy_that_was_run_and_deleted_leads_to_the_labs_cell(notebook: Notebook) -> None:
    notebook.run(TALKER, "copy")
    notebook.save(answer(TALKER.replace("0.05", "0.06")))
    later(notebook)
    for shown in said(notebook):
        assert "`talker` was written by a cell that is no longer in the notebook." in shown
        assert "begins with `%%node talker`. Run that cell, and then this check." in shown
    write(notebook)
    assert "no longer in the notebook" not in "".join(said(notebook))


def test_an_id_that_no_notebook_has_says_nothing_of_the_cell(notebook: Notebook) -> None:
    """As Visual Studio Code tells it: the address of a document of its own."""
    notebook.run(TALKER, "vscode-notebook-cell:/home/ann/lab.ipynb#W2sZmlsZQ%3D%3D")
    notebook.save(answer(TALKER.replace("0.05", "0.06")))
    assert "which is not in the saved notebook" not in "".join(said(notebook))


def test_copies_and_pieces_that_do_not_count_are_told_as_by_grading(notebook: Notebook) -> None:
    piece = ("piece", "print('the second half')", answer("")[2])
    notebook.save(answer(TALKER), piece, answers=FILES)
    notebook.run(TALKER, "talker")
    for shown in said(notebook):
        assert SPLIT.format("%%node talker") in shown
    identity, source, metadata = answer(TALKER)
    given = {"nbgrader": metadata["nbgrader"] | {"solution": False, "locked": True}}
    notebook.save((identity, source, given), ("copy", source, given))
    assert told_of_given_copies("talker", 2) in said(notebook)[0]


def test_a_cell_that_was_split_after_its_run_is_told_as_split_and_as_nothing_else(notebook: Notebook) -> None:
    """JupyterLab leaves the id of the cell to its last piece. To move the text there would be wrong advice."""
    notebook.run(TALKER, "talker")
    marks = answer("")[2]
    head, middle, tail = TALKER.partition("class")
    notebook.save(("another-id", head, marks), ("talker", middle + tail, marks), answers=FILES)
    for shown in said(notebook):
        assert shown.count(SPLIT.format("%%node talker")) == 1
        assert "was written by a cell of your own" not in shown


def later(notebook: Notebook) -> None:
    """The notebook was saved after all that has been run; the clock of files may be some milliseconds behind."""
    os.utime(notebook.path, (time.time() + 60, time.time() + 60))


def test_a_program_that_grading_does_not_find_is_named(notebook: Notebook) -> None:
    cell = f"%%time\n{TALKER}"
    notebook.run(cell, "talker")
    notebook.save(answer(cell))
    later(notebook)
    assert "No cell of the saved notebook begins with `%%node talker`" in notebook.run(CHECK).text


def test_a_file_that_no_cell_wrote_and_a_program_reads_is_named(notebook: Notebook) -> None:
    write(notebook, TALKER.replace("rclpy.init()", "print(open('words.csv').read())\nrclpy.init()"))
    words = notebook.path.parent / "nodes/lab/words.csv"
    words.write_text("a,b\n")
    shown = " ".join(notebook.run(CHECK).text.split())
    words.unlink()
    assert "words.csv, so it is missing when the notebook is graded." in shown


def test_a_file_that_was_removed_is_said_to_be_gone(notebook: Notebook) -> None:
    write(notebook)
    (notebook.path.parent / "nodes/lab/talker.py").unlink()
    shown = notebook.run(CHECK).text
    assert "talker.py is gone" in shown and "has not been run" not in shown


def test_of_a_renamed_notebook_nothing_is_said_that_nobody_can_know(notebook: Notebook) -> None:
    write(notebook)
    notebook.path.rename(notebook.path.with_name("renamed.ipynb"))
    shown = notebook.run(CHECK).text
    lab = notebook.run("%lab").text
    notebook.path.with_name("renamed.ipynb").rename(notebook.path)
    assert "lab.ipynb no longer exists" in shown and "not saved" not in shown
    assert "If you renamed the notebook, shut down its kernel and open it again." in " ".join(lab.split())


def test_a_cell_of_the_labs_own_that_was_changed_is_named(notebook: Notebook) -> None:
    for changed in (False, True):
        text = TALKER + "# mine\n" * changed
        identity, source, metadata = answer(text)
        metadata["nbgrader"] |= {"solution": False, "locked": True}
        checksum = hashlib.md5(f"{TALKER}codeFalseFalseTruetalker".encode()).hexdigest()  # as nbgrader makes it
        notebook.save((identity, source, {"nbgrader": metadata["nbgrader"] | {"checksum": checksum}}))
        notebook.run(text, "talker")
        shown = " ".join(notebook.run(CHECK).text.split())
        assert ("belongs to the lab and has been changed" in shown) is changed


def test_no_given_cell_of_a_released_lab_counts_as_changed() -> None:
    labs = sorted((ROOT / "labs").glob("*/*.ipynb"))
    assert labs
    assert [cell.file_name for lab in labs for cell in SavedNotebook(lab).cells if cell.altered] == []


def test_an_untouched_answer_earns_nothing_and_is_no_failure(notebook: Notebook) -> None:
    blank = "%%node talker\nprint('# YOUR CODE HERE')"
    notebook.save(answer(blank, blank=blank))
    notebook.run(blank, "talker")
    shown = notebook.run('with launch("talker") as ros:\n    ros.program("talker").expect_exit()\nros.score(2)').result
    assert shown.startswith("○ not attempted yet  0 of 2 points\n")
    assert "The cell `%%node talker` is still as you received it." in shown


def test_a_missing_program_is_said_at_once(notebook: Notebook) -> None:
    notebook.save(answer(TALKER.replace("talker", "sleeper"), "sleeper"))
    check = notebook.run(CHECK.replace('"talker"', '"sleeper"')).text
    assert "The cell `%%node sleeper` has not been run since the kernel started" in check
    assert "Run the cell `%%node sleeper` first" in check
    listening = 'with launch("sleeper") as ros:\n    print(ros.topic("/chatter", String).listen())'
    assert "Run the cell `%%node sleeper` first" in notebook.run(listening).error
    unknown = notebook.run(listening.replace("sleeper", "sleper"))
    assert "no cell of the saved notebook begins with `%%node sleper`" in unknown.error
    assert "Traceback" not in unknown.error and not unknown.text


def test_a_notebook_is_known_while_jupyterlab_saves_it(notebook: Notebook) -> None:
    notebook.save(answer(TALKER))
    with atomic_writing(str(notebook.path)) as file:  # it is empty until the end of this block
        unknown = notebook.run('with launch("talkr") as ros:\n    print(ros.topic("/chatter", String).listen())').error
        assert "no cell of the saved notebook begins with `%%node talkr`" in unknown
        lab = notebook.run("%lab")
        assert "not valid JSON" not in lab.text and not lab.error
        assert not notebook.path.read_text()
        file.write("{")  # a part of the new text
        file.flush()
        assert "no cell of the saved notebook" in notebook.run('with launch("talkr") as ros:\n    pass').error


def test_a_table_that_was_not_written_is_said_as_well(notebook: Notebook) -> None:
    notebook.save(answer("%%file table.yaml\na: 1", "table"))
    shown = notebook.run(
        "from autograder.checks import answers\n"
        'with answers("table.yaml") as table:\n    table.expect_answer("a", 1)\ntable.score(1)'
    )
    assert "Run the cell `%%file table.yaml` first" in shown.text and "0 of 1 point" in shown.text


@pytest.mark.parametrize(
    ("line", "error"),
    [("1 / 0", "ZeroDivisionError"), ('ros.lisen("/chatter", String)', "AttributeError"), ("Int32", "NameError")],
)
def test_an_exception_reaches_the_student_as_python_shows_it(notebook: Notebook, line: str, error: str) -> None:
    write(notebook)
    shown = notebook.run(f'with launch("talker") as ros:\n    {line}\nprint("after")')
    assert error in shown.error and "Traceback" in shown.error and "after" not in shown.text
    scored = notebook.run(f'with launch("talker") as ros:\n    {line}\nros.score(2)')
    assert error in scored.error and "points" not in scored.text
    told = "A cell above this check defines `Int32`, and it has not been run"
    assert (told in scored.text, told in shown.text) == (error == "NameError", False)


def test_what_a_cell_without_a_score_expected_is_shown(notebook: Notebook) -> None:
    write(notebook)
    shown = notebook.run('with launch("talker") as ros:\n    ros.topic("/chatter", String).expect_publisher()')
    assert "✓ passed" in shown.text and "points" not in shown.text
    shown = notebook.run('with launch("talker") as ros:\n    ros.topic("/chater", String).expect_publisher(within=20)')
    assert "✗ failed" in shown.text and "/chatter" in shown.text
    assert not notebook.run("1 + 1").html


def test_a_nodes_output_streams_while_a_cell_explores(notebook: Notebook) -> None:
    write(notebook)
    shown = notebook.run(
        'with launch("talker") as ros:\n    heard = ros.topic("/chatter", String).listen()\n'
        "    ros.wait(lambda: heard.count >= 3)"
    )
    assert shown.text.count("talker | tick <b>\n") >= 3 and "\x1b" not in shown.text
    assert "tick <b>" in notebook.run('ros.log("talker")').text
    assert "<details open><summary>Output of <code>talker</code>" in shown.html
    notebook.run("%%node levels\nprint('[WARN] [1.0] [a]: low\\n[INFO] [1.0] [a]: <fine>')")
    levels = notebook.run('with launch("levels") as ros:\n    ros.wait(lambda: False, within=30)').html
    assert ">[WARN] [1.0] [a]: low</span>" in levels and "\n[INFO] [1.0] [a]: &lt;fine&gt;" in levels
    many = notebook.run("%%node many\nfor number in range(1000):\n    print(number)\n")
    assert "written" in many.text
    flood = notebook.run('with launch("many") as ros:\n    ros.wait(lambda: False, within=30)').text
    assert "many | 99\n" in flood and "many | 100\n" not in flood and "[more is in ros.log()]" in flood


def test_a_cell_that_only_looks_has_no_verdict_but_for_what_failed(notebook: Notebook) -> None:
    write(notebook)
    looks = 'with launch("talker", "talker") as ros:\n'
    looks += '    ros.service("/nothing", Trigger).call(Trigger.Request(), within=1)'
    assert "passed" not in notebook.run('with launch("talker") as ros:\n    ros.graph.wait(ros.graph.nodes)').text
    shown = notebook.run(f"from std_srvs.srv import Trigger\n{looks}")
    assert "✗ failed" in shown.text
    # Two programs of one name are two folds that can be told apart.
    assert "Output of <code>talker</code>" in shown.html and "Output of <code>talker (2)</code>" in shown.html


def test_what_cannot_be_started_or_drawn_is_a_sentence_and_what_runs_goes_on(notebook: Notebook) -> None:
    write(notebook)
    up = 'robot.graph.publishers("/chatter") and robot.graph.nodes() == ["/talker"]'
    notebook.run(f'robot = launch("talker").start()\nrobot.wait(lambda: {up}, within=150)')
    for typo, sentence in (
        ('launch("taker").start()', "There is no `taker`"),
        ('robot.log("taker")', "no program 'taker' was started; there is talker."),
        ('launch(["talker"]).start()', "is no name of a program; write each name as a text of its own."),
        ('launch("talker", remappings={"chatter": "news"}).start()', 'write pairs, [("OLD", "NEW")].'),
        ('launch("talker", remappings=("chatter", "news")).start()', 'write pairs, [("OLD", "NEW")].'),
        ("robot.draw.qos()", 'qos: it is about one topic, such as ros.draw.qos("/chatter"). Topics here: "/chatter".'),
        ("robot.draw.arrivals()", 'Topics here: "/chatter".'),
        ('robot.draw.lifecycle("/talker")', "`/talker` is no lifecycle node"),
    ):
        shown = notebook.run(typo)
        assert sentence in shown.error and "autograder/checks" not in shown.error
        assert "running: talker (nodes so far: /talker)" in notebook.run("print(robot)").text
    notebook.run("robot.stop()")
    for late in ('robot.start("talker")', 'robot.publisher("/late", String)', 'robot.lifecycle("/talker")'):
        shown = notebook.run(late)
        assert "This launch has ended. Begin another one" in shown.error and "autograder/checks" not in shown.error


def test_no_traceback_of_a_node_shows_the_kit_and_input_is_explained(notebook: Notebook) -> None:
    body = """import threading, rclpy
from rclpy.action import ActionServer
from test_msgs.action import Fibonacci
def execute(goal_handle):
    raise ValueError("in execute")
def work():
    raise KeyError("in a thread")
rclpy.init()
node = rclpy.create_node("thrower")
server = ActionServer(node, Fibonacci, "fibonacci", execute)
threading.Thread(target=work).start()
try:
    rclpy.spin(node)
finally:
    input()
"""
    write(notebook, f"%%node talker\n{body}")
    shown = notebook.run(
        "from test_msgs.action import Fibonacci\n"
        'with launch("talker") as ros:\n    goal = ros.action("/fibonacci", Fibonacci).send_goal(Fibonacci.Goal())\n'
        "    goal.wait_for_result()\n"
        "    print(ros.log())"
    )
    assert "in execute" in shown.text and "in a thread" in shown.text and "sandbox/inside" not in shown.text
    write(notebook, "%%node talker\nname = input()")
    assert "has no keyboard" in " ".join(notebook.run(CHECK).text.split())


def test_a_nodes_output_stands_under_a_failed_check_only(notebook: Notebook) -> None:
    write(notebook)
    failed = CHECK.replace("/chatter", "/chater").replace("at_least=2", "at_least=2, within=20")
    shown = notebook.run(failed)
    assert "output of talker" in shown.text and "<details" in shown.html and "tick &lt;b&gt;" in shown.html
    assert "tick" not in notebook.run(CHECK).text


def test_one_line_number_everywhere(notebook: Notebook) -> None:
    source = "\n%%node talker\nimport time\ntime.sleep(0)\nraise ValueError('here')\n"
    write(notebook, source)
    shown = notebook.run(CHECK).text
    assert "line 5" in shown and 'talker.py", line 5' in shown


def test_a_launch_as_last_line_runs_and_says_what_happens(notebook: Notebook) -> None:
    write(notebook)
    shown = notebook.run('launch("talker")').text
    assert "talker | tick" in shown and "/talker publishes /chatter (std_msgs/msg/String)" in shown
    assert 'with launch("talker") as ros:' in shown


def test_a_wait_says_what_it_waits_for_and_cleans_up(notebook: Notebook) -> None:
    write(notebook)
    shown = notebook.run(CHECK.replace("at_least=2", "at_least=40"))
    assert "Waiting for messages on `/chatter`" in shown.text
    assert shown.types.count("display_data") == 1
    # The last update of the line takes it away.
    assert shown.types[-2:] == ["update_display_data", "execute_result"]
    assert "\n\n✓ passed" in shown.text


def test_a_check_that_fails_where_others_have_the_cpus_says_so(notebook: Notebook) -> None:
    """The kernel and its programs are kept from the CPUs as on a busy machine; what was measured stands for that."""
    write(notebook)
    notebook.run(
        "from autograder.graph.patience import Patience\nreal = Patience.decided\nPatience.decided = lambda self: 0.02"
    )

    def told(check: str) -> bool:
        return "for 0.02 s while this check was running." in " ".join(notebook.run(check).text.split())

    fails = CHECK.replace("at_least=2", "at_least=2, at_most=0")
    assert told(fails) and not told(CHECK)
    notebook.run("Patience.decided = real")
    assert not told(fails)


def test_an_interrupted_check_has_no_verdict_wherever_that_finds_it(notebook: Notebook) -> None:
    """At any moment: in the kit's set-up, in a wait, in the check's own lines, at the end of the block."""
    write(notebook)
    whole = notebook.run(CHECK)
    threads = "import os\nprint(len(os.listdir('/proc/self/task')))"  # with those of the middleware
    before = int(notebook.run(threads).text)
    moments = random.Random(19)
    interrupted = 0
    while interrupted < 8:
        shown = notebook.run(CHECK, interrupt_after=moments.uniform(0, whole.seconds))
        if shown.error:
            interrupted += 1
            assert (shown.error, shown.result, "expectation" in shown.text) == (NO_VERDICT, "", False)
        else:  # it came when all was said; the machine is faster now
            assert shown.result == whole.result
            whole = shown
    deadline = time.monotonic() + 60
    while int(notebook.run(threads).text) > before and time.monotonic() < deadline:
        pass
    assert int(notebook.run(threads).text) <= before
    assert notebook.run("from autograder.checks import current\nprint(current.check.block)").text == "None\n"
    assert notebook.run(CHECK).result == whole.result


INTERRUPTED_WHEN_SENT = """
exec('''
import os, signal
hook = get_ipython().displayhook
send = hook.session.send

def send_and_interrupt(*args, **kwargs):
    sent = send(*args, **kwargs)
    if args[1] is hook.msg:
        os.kill(os.getpid(), signal.SIGINT)
    return sent

hook.session.send = send_and_interrupt
''', {"get_ipython": get_ipython})
"""
"""The interrupt comes when the value of a cell has just been sent, in code that is no cell's, on every machine."""


def test_an_interrupt_that_comes_when_the_verdict_has_just_been_sent_does_not_take_it_back(notebook: Notebook) -> None:
    write(notebook)
    whole = notebook.run(CHECK)
    notebook.run(INTERRUPTED_WHEN_SENT)
    shown = notebook.run(CHECK)
    notebook.run("del get_ipython().displayhook.session.send")
    assert (shown.error, shown.result.splitlines()[0]) == ("", whole.result.splitlines()[0])
    again = notebook.run(CHECK)
    assert (again.error, again.result.splitlines()[0]) == ("", whole.result.splitlines()[0])


@pytest.mark.parametrize("expectation", ["node('/talker').expect()", "require(True, 'All is well')"])
def test_an_interrupted_check_that_expects_without_a_score_says_the_same(notebook: Notebook, expectation: str) -> None:
    write(notebook)
    kill = "os.kill(os.getpid(), signal.SIGINT)"
    cell = f'import os, signal\nwith launch("talker") as ros:\n    ros.{expectation}\n    '
    for interrupted in (kill, f"ros.wait(lambda: {kill}, within=600)"):
        shown = notebook.run(cell + interrupted)
        assert (shown.error, "passed" in shown.text) == (NO_VERDICT, False)


def test_an_interrupt_while_a_cell_explores_ends_what_it_started(notebook: Notebook) -> None:
    write(notebook)
    cell = 'import os, signal\nwith launch("talker"):\n    os.kill(os.getpid(), signal.SIGINT)\n    print("after")'
    shown = notebook.run(cell)
    assert "KeyboardInterrupt" in shown.error and "after" not in shown.text.splitlines()
    waiting = """import threading
waits = threading.Event()
threading.Thread(target=lambda: (waits.wait(), os.kill(os.getpid(), signal.SIGINT))).start()
with launch("talker") as ros:
    ros.wait(waits.set, within=600)"""
    assert notebook.run(waiting).error == "Interrupted."
    assert "✓ passed" in notebook.run(CHECK).text


def test_a_start_that_is_interrupted_leaves_nothing_running(notebook: Notebook) -> None:
    """Nobody has a name for it by which it could be stopped."""
    notebook.run("%%node quiet\nimport time\ntime.sleep(600)")
    while not notebook.run('robot = launch("quiet").start()', interrupt_after=2.0).error:
        pass  # it waits for five seconds for a node; the machine is slow
    assert notebook.run("from autograder.checks import current\nprint(current.check.robot)").text == "None\n"


def test_an_interrupted_command_ends_its_cell(notebook: Notebook) -> None:
    write(notebook)
    notebook.run('robot = launch("talker").start()')
    for command in ("echo /silent std_msgs/msg/String", "pub --once -w 0 --keep-alive 600 /said std_msgs/msg/String"):
        while not (shown := notebook.run(f"%ros2 topic {command}\nprint('after')", interrupt_after=2.0)).error:
            assert "stopped after 10 s" in shown.text  # the machine is slow
        assert "Interrupted" in shown.error and "after" not in shown.text.split()
    notebook.run("robot.stop()")


def test_what_a_subshell_answers_leaves_the_interrupts_of_the_cell_alone(notebook: Notebook) -> None:
    """JupyterLab sends what widgets say over subshells, each a thread of the kernel, while a cell runs."""
    write(notebook)
    subshell = notebook.open_subshell()
    cell = 'with launch("talker") as ros:\n    ros.node("/talker").expect()\n    ros.wait(lambda: False, within=60)'
    with ThreadPoolExecutor() as pool:
        ran = pool.submit(notebook.run, cell)
        notebook.ask(subshell)
        while not ran.done():
            notebook.interrupt()
            wait([ran], timeout=1)
    shown = ran.result()
    assert (shown.error, "passed" in shown.text) == (NO_VERDICT, False)


def test_one_click_interrupts_once() -> None:
    interrupts.begin({})
    try:
        os.kill(os.getpid(), signal.SIGINT)
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # a reminder is under way and comes late
        deadline = time.monotonic() + 60
        while signal.SIGINT not in signal.sigpending() and time.monotonic() < deadline:
            pass
        with pytest.raises(interrupts.Interrupted):
            interrupts.here()
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        interrupts.here()
        os.kill(os.getpid(), signal.SIGINT)
        with pytest.raises(interrupts.Interrupted):
            interrupts.here()
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        interrupts.end()


def test_an_interrupt_that_the_cell_catches_is_told_once(notebook: Notebook) -> None:
    write(notebook)
    cell = f"""{SET_UP}
import os, signal
robot = launch("talker").start()
try:
    robot.wait(lambda: os.kill(os.getpid(), signal.SIGINT), within=600)
except KeyboardInterrupt:
    robot.stop()
    print("stopped")"""
    shown = notebook.run(cell)
    assert "stopped" in shown.text and not shown.error


def test_a_module_of_the_students_own_is_imported(notebook: Notebook) -> None:
    base = "%%node my_base\nTOPIC = 'chatter'"
    user = TALKER.replace("import rclpy\n", "import rclpy\nimport my_base\n").replace('"chatter"', "my_base.TOPIC")
    notebook.save(answer(user), ("own", base, {}))
    notebook.run(base, "own")
    notebook.run(user, "talker")
    shown = notebook.run(CHECK).text
    assert "✓ passed" in shown and "`my_base` from cell [" in shown
    (notebook.path.parent / "nodes" / "lab" / "by_hand.py").write_text("TOPIC = 'chatter'\n")
    by_hand = user.replace("my_base", "by_hand")
    notebook.save(answer(by_hand))
    notebook.run(by_hand, "talker")
    shown = " ".join(notebook.run(CHECK).text.split())
    assert "by_hand.py, so it is missing when the notebook is graded" in shown


def test_after_a_restart_a_program_counts_only_once_its_cell_was_run(tmp_path: Path) -> None:
    made = Notebook(tmp_path)
    try:
        made.run(SET_UP)
        write(made)
        assert "✓ passed" in made.run(CHECK).text
        made.restart()
        made.run(SET_UP)
        assert "has not been run since the kernel started" in made.run(CHECK).text
    finally:
        made.close()


def test_launches_leave_no_logs_behind(notebook: Notebook) -> None:
    write(notebook)
    notebook.run(CHECK)
    count = "import os, pathlib\nlen([*pathlib.Path(os.environ['ROS_LOG_DIR']).glob(f'*_{os.getpid()}_*')])"
    assert notebook.run(count).text.strip() == "0"


def test_without_the_set_up_cell_it_is_named(tmp_path: Path) -> None:
    made = Notebook(tmp_path)
    try:
        for cell in (CHECK, TALKER, "%lab"):
            shown = made.run(cell)
            assert "Run the first code cell of the notebook" in shown.text, shown
        assert "Run the first" not in made.run("unknown").text
        assert "Run the last cell above this one that makes it" in made.run("robot.show()").text
        assert "NameError" in made.run("unknown").error
        made.run(SET_UP)
        write(made)
        assert "✓ passed" in made.run(CHECK).text
    finally:
        made.close()


def test_in_markdown_a_report_is_text(notebook: Notebook, tmp_path: Path) -> None:
    from nbformat.v4 import new_code_cell, new_notebook, new_output

    write(notebook)
    shown = notebook.run(CHECK)
    data = {"text/plain": shown.text, "text/html": shown.html}
    output = new_output("execute_result", data, execution_count=1)
    path = tmp_path / "report.ipynb"
    path.write_text(json.dumps(new_notebook(cells=[new_code_cell(CHECK, outputs=[output])])))
    subprocess.run([sys.executable, "-m", "nbconvert", "--to", "markdown", path], check=True, timeout=START)
    text = (tmp_path / "report.md").read_text()
    assert "✓ passed  2 of 2 points" in text and "<div" not in text


def test_every_name_of_the_set_up_cell_leads_to_it() -> None:
    assert set(hints.NAMES) == set(autograder.checks.__all__)


def test_an_unused_extension_does_no_harm(tmp_path: Path) -> None:
    code = (
        "import sys\nfrom IPython.core.interactiveshell import InteractiveShell\nshell = InteractiveShell.instance()\n"
    )
    code += "shell.run_line_magic('load_ext', 'autograder')"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=START)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert not (tmp_path / "nodes").exists()


GUESSES = "%%file predictions.yaml\nbeats_predicted: 7\nbeats_measured: 0\nticks_predicted: pause\n3: 4"
FILLED = (
    "from autograder.checks import answers\nwith answers('predictions.yaml') as table:\n"
    "    table.expect_answer('beats_measured', 0)\ntable.score(3)"
)


def test_lab_says_what_is_done_what_is_open_and_what_was_predicted(notebook: Notebook) -> None:
    marks = {"grade": True, "solution": False, "locked": True, "task": False, "schema_version": 3}
    check = {"nbgrader": marks | {"grade_id": "check", "points": 3}}
    later = {"nbgrader": marks | {"grade_id": "later", "points": 2}}
    again = {"nbgrader": marks | {"grade_id": "again", "points": 1}}
    text = {"nbgrader": marks | {"grade_id": "why", "points": 4, "solution": True}}
    *_, guesses = answer(GUESSES, "predictions")
    cells = [
        ("markdown", "# Lab 0: Hearts", {}),
        ("markdown", "## 1. Beats", {}),
        ("code", GUESSES, guesses),
        ("code", FILLED, check),
        ("markdown", "## 2. Ticks", {}),
        ("code", f"{CHECK}  # of this notebook", later),
        ("markdown", "### Check: once more\n```\n# a comment\n```", {}),
        ("code", f"{CHECK}  # of this notebook, again", again),
        ("markdown", "## 3. Explain", {}),
        ("markdown", "Because.", text),
    ]
    made = [
        {"cell_type": kind, "id": f"c{number}", "source": source, "metadata": metadata}
        | ({"outputs": [], "execution_count": None} if kind == "code" else {})
        for number, (kind, source, metadata) in enumerate(cells)
    ]
    notebook.path.write_text(json.dumps({"cells": made, "metadata": {}, "nbformat": 4, "nbformat_minor": 5}))
    notebook.run(GUESSES, "c2")
    notebook.run("%%file predicted.yaml\npairs: [live, none]\nempty: [live, '?']\n")
    notebook.run("%%file measured.yaml\npairs: [live, none]\nempty: [live, all]\n")
    notebook.run(FILLED, "c3")
    said = notebook.run("%lab")
    lines = [" ".join(line.split()) for line in said.text.splitlines()]
    assert lines[0] == "Lab 0: Hearts: 2 of 4 tasks done · 3 of 6 points"
    assert "✓ 1. Beats passed 3 of 3 points" in lines and "Go on with: 2. Ticks" in lines
    assert "2. Ticks 0 of 3 points" in lines and "○ Once more not run in this kernel 1 point" in lines
    assert "○ 2. Ticks not run in this kernel 2 points" in lines
    assert "✓ 3. Explain written 4 points, given by a person" in lines
    assert "beats 7 0 otherwise" in lines and "ticks pause open" in lines
    assert "pairs live, none live, none as predicted" in lines and "empty live, all open" in lines
    assert "<b>2. Ticks</b>" in said.html
    notebook.run(GUESSES, "c2")
    assert "passed, but a cell above was run again since" in notebook.run("%lab").text
    for source in ("YOUR ANSWER HERE", "YOUR ANSWER HERE\n"):
        made[-1] = made[-1] | {"source": source, "id": f"why-{len(source)}"}
        made.append(made[-1])
    notebook.path.write_text(json.dumps({"cells": made, "metadata": {}, "nbformat": 4, "nbformat_minor": 5}))
    assert "3. Explain not written yet" in " ".join(notebook.run("%lab").text.split())
