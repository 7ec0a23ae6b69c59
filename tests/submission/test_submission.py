"""Reading labs and submissions: text in, text out, and a named outcome for everything that is wrong."""

from __future__ import annotations

import copy
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import toy
from hypothesis import given
from hypothesis import strategies as st
from places import ROOT

from autograder.course.cells import grade_id_of, parse, source_of
from autograder.course.lab import Lab, load_lab
from autograder.submission.answers import OWN_FILES, Submission
from autograder.submission.copies import pieces_of, told_of_copies
from autograder.submission.notebook_file import NOTEBOOK_BYTES
from autograder.submission.reader import PROBLEMS_KEPT, read_submission


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return load_lab(toy.make_course(tmp_path / "course"), toy.LAB)


def read(lab: Lab, tmp_path: Path, content: Any) -> Submission:
    return read_submission(toy.hand_in(tmp_path, "ann", content), lab)


def solved(lab: Lab, **sources: str) -> list[dict[str, Any]]:
    answers = {answer.grade_id: answer.solution for answer in lab.answers.values()}
    cells: list[dict[str, Any]] = lab.clean_notebook(answers | sources)["cells"]
    return cells


def by_id(cells: list[dict[str, Any]], grade_id: str) -> dict[str, Any]:
    return next(cell for cell in cells if grade_id_of(cell) == grade_id)


def codes(submission: Submission) -> list[str]:
    return [problem.code for problem in submission.problems]


def test_answers_become_files(lab: Lab, tmp_path: Path) -> None:
    submission = read(lab, tmp_path, solved(lab, talker="%%node talker\r\nprint(1)\r\n"))
    assert codes(submission) == []
    assert submission.files["talker.py"] == "# %%node talker\nprint(1)\n"
    assert submission.files["answers.yaml"] == "answer: 42\n"
    assert submission.files["helper.py"] == "# %%node helper\nprint('given')\n"


def plain_cell(source: str) -> dict[str, Any]:
    return toy.cell("code", source, 99)


def test_a_programs_lines_have_the_numbers_of_its_cell() -> None:
    source = "\n%%node talker\nimport time\nraise ValueError\n"
    file = parse(source)
    assert file is not None
    assert file.text.splitlines()[2:] == source.splitlines()[2:]
    assert file.text.splitlines()[1] == "# %%node talker"


def test_modules_and_files_of_the_students_own_are_taken_along(lab: Lab, tmp_path: Path) -> None:
    cells = solved(lab, talker="%%node talker\nimport my_base")
    cells += [plain_cell("%%node my_base\nNAME = 1"), plain_cell("%%file mine.yaml\na: 1"), plain_cell("x = 1")]
    submission = read(lab, tmp_path, cells)
    assert codes(submission) == []
    assert submission.files["my_base.py"] == "# %%node my_base\nNAME = 1\n"
    assert submission.files["mine.yaml"] == "a: 1\n"
    cells[-3]["source"] = "%%node my_base\nNAME = 2"
    assert read(lab, tmp_path, cells).digest != submission.digest


def test_a_copied_answer_cell_with_another_name_is_a_file_of_the_students_own(lab: Lab, tmp_path: Path) -> None:
    cells = solved(lab)
    answer = by_id(cells, "talker")
    copied = copy.deepcopy(answer) | {"source": "%%node my_base\nNAME = 1", "id": "copied"}
    submission = read(lab, tmp_path, [*cells, copied])
    assert codes(submission) == []
    assert submission.sources["talker"] == answer["source"]
    assert "my_base.py" in submission.files


@pytest.mark.parametrize(
    ("source", "code", "said"),
    [
        ("%%node talker\nprint('better')", "ignored-cell", "only the cell `talker` counts for this answer"),
        ("%%node helper\nprint('mine')", "ignored-cell", "helper.py belongs to the lab"),
        ("%%node rclpy\nx = 1", "bad-file-name", "the name of an installed module"),
        ("%%node json\nx = 1", "bad-file-name", "the name of an installed module"),
    ],
)
def test_a_cell_that_grading_ignores_is_named(lab: Lab, tmp_path: Path, source: str, code: str, said: str) -> None:
    plain = read(lab, tmp_path, solved(lab))
    submission = read(lab, tmp_path, [*solved(lab), plain_cell(source)])
    assert codes(submission) == [code]
    assert said in submission.problems[0].because
    assert submission.files == plain.files


def test_a_cell_that_says_the_same_again_is_no_problem(lab: Lab, tmp_path: Path) -> None:
    cells = solved(lab)
    assert codes(read(lab, tmp_path, [*cells, plain_cell(by_id(cells, "talker")["source"])])) == []


def test_files_of_the_students_own_have_a_limit(lab: Lab, tmp_path: Path) -> None:
    cells = [*solved(lab), *(plain_cell(f"%%node mine{number}\n") for number in range(OWN_FILES + 1))]
    submission = read(lab, tmp_path, cells)
    assert codes(submission) == ["too-many-files"]
    assert len(submission.files) == 3 + OWN_FILES


def test_of_very_many_problems_the_first_are_listed_and_the_others_counted(lab: Lab, tmp_path: Path) -> None:
    ignored = [plain_cell(f"%%node helper\nprint({number})") for number in range(PROBLEMS_KEPT + 2)]
    submission = read(lab, tmp_path, [*solved(lab), *ignored])
    assert codes(submission) == ["ignored-cell"] * PROBLEMS_KEPT + ["more-problems"]
    assert "2 more problems" in submission.problems[-1].because


def test_sources_may_be_lists_of_lines(lab: Lab, tmp_path: Path) -> None:
    cells = solved(lab)
    plain = read(lab, tmp_path, cells)
    for cell in cells:
        cell["source"] = cell["source"].splitlines(keepends=True)
    assert read(lab, tmp_path, cells).digest == plain.digest


def test_only_answers_get_into_the_clean_notebook(lab: Lab, tmp_path: Path) -> None:
    cells = solved(lab)
    for cell in cells:
        cell["metadata"]["tags"] = ["skip-execution"]
        cell["attachments"] = {"x.png": {"image/png": "AAAA"}}
        if cell["cell_type"] == "code":
            cell["outputs"] = [{"output_type": "execute_result", "data": {"text/plain": "9753"}, "metadata": {}}]
    cells.append(toy.cell("code", "import os", 99))
    clean = json.dumps(lab.clean_notebook(read(lab, tmp_path, cells).sources))
    assert "skip-execution" not in clean and "9753" not in clean


def test_defects_are_named_one_by_one(lab: Lab, tmp_path: Path) -> None:
    def defect(change: Any) -> list[str]:
        cells = solved(lab)
        change(cells)
        submission = read(lab, tmp_path, cells)
        assert submission.readable
        return codes(submission)

    def flip(cells: list[dict[str, Any]]) -> None:
        by_id(cells, "check_talker")["metadata"]["nbgrader"]["solution"] = True

    def edit(cells: list[dict[str, Any]]) -> None:
        by_id(cells, "check_talker")["source"] = "3"

    def rename(cells: list[dict[str, Any]]) -> None:
        by_id(cells, "talker")["metadata"]["nbgrader"]["grade_id"] = "talker2"

    def say(grade_id: str, source: Any) -> Any:
        return lambda cells: by_id(cells, grade_id).update(source=source)

    assert defect(lambda cells: cells.remove(by_id(cells, "talker"))) == ["missing-cell"]
    assert defect(lambda cells: cells.remove(by_id(cells, "check_talker"))) == []
    assert defect(lambda cells: cells.append(copy.deepcopy(by_id(cells, "talker")))) == ["duplicated-cell"]
    assert defect(rename) == ["forged-cell", "missing-cell"]
    assert defect(flip) == ["forged-flags"]
    assert defect(edit) == ["changed-cell"]
    assert defect(say("talker", "%%node talker\n" + "x" * 70_000)) == ["oversized-cell"]
    assert defect(say("talker", 7)) == ["not-a-notebook"]
    assert defect(say("talker", "%%node ../../talker\nx")) == ["bad-file-name"]
    assert defect(say("talker", "print(1)")) == ["no-file-name"]
    assert defect(say("talker", "%%node talkr\nx")) == ["renamed-file"]
    assert defect(say("talker", "%%node helper\nx")) == ["given-file"]
    assert defect(say("talker", "%%file answers.yaml\nx")) == ["renamed-file", "same-file"]


@pytest.mark.parametrize("kept", ["talker", "answers"])
def test_of_two_answers_that_were_merged_one_sentence_says_so(kept: str, lab: Lab, tmp_path: Path) -> None:
    """JupyterLab gives the merged cell the mark of either, whichever was the active one."""
    cells = solved(lab)
    gone = {"talker": "answers", "answers": "talker"}[kept]
    text = f"{source_of(by_id(cells, 'talker'))}\n\n{source_of(by_id(cells, 'answers'))}"
    by_id(cells, kept)["source"] = text
    submission = read(lab, tmp_path, [cell for cell in cells if grade_id_of(cell) != gone])
    (problem,) = submission.problems
    assert problem.code == "missing-cell" and f"`{gone}` was merged into the cell `{kept}`" in problem.because
    assert "%%file answers.yaml" in submission.files["talker.py"]


def test_of_copies_of_an_answer_the_last_one_counts_and_of_a_text_all(lab: Lab, tmp_path: Path) -> None:
    """Copied, split or pasted elsewhere: a copy that was given another name is a file of the student's own."""
    cells = json.loads(json.dumps(solved(lab)))

    def copied(grade_id: str, source: str) -> None:
        cells.append({**by_id(cells, grade_id), "id": f"copy-{len(cells)}", "source": source})

    copied("talker", "%%node talker\nprint('second')")
    copied("talker", "%%node other\nprint('mine')")
    copied("talker", "print('the second half of a cell that was split')")
    copied("why", "And also because.")
    submission = read(lab, tmp_path, cells)
    assert submission.files["talker.py"] == "# %%node talker\nprint('second')\n"
    assert submission.files["other.py"] == "# %%node other\nprint('mine')\n"
    assert submission.sources["why"].endswith("\n\nAnd also because.")
    told = [problem.because for problem in submission.problems if problem.code == "duplicated-cell"]
    assert told == [told_of_copies("%%node talker", 2), told_of_copies("why", 2, is_file=False)]


def test_a_copied_answer_cell_with_the_name_of_another_answer_is_told(lab: Lab, tmp_path: Path) -> None:
    cells = solved(lab)
    mine = "%%file answers.yaml\nanswer: 41"
    cells.append(copy.deepcopy(by_id(cells, "talker")) | {"source": mine, "id": "copied"})
    submission = read(lab, tmp_path, cells)
    assert codes(submission) == ["ignored-cell"]
    assert "only the cell `answers` counts for this answer" in submission.problems[0].because
    assert "41" not in submission.files["answers.yaml"]


def test_an_answer_that_is_no_code_cell_any_more_is_no_program(lab: Lab, tmp_path: Path) -> None:
    """As in the notebook, where nobody can run it."""
    cells = json.loads(json.dumps(solved(lab)))
    by_id(cells, "talker")["cell_type"] = "markdown"
    submission = read(lab, tmp_path, cells)
    assert codes(submission) == ["missing-cell"]
    assert "is no longer a code cell" in submission.problems[0].because
    assert submission.sources["talker"] == lab.answers["talker"].blank


def test_the_piece_of_an_answer_that_was_split_off_is_told(lab: Lab, tmp_path: Path) -> None:
    cells = json.loads(json.dumps(solved(lab)))
    cells.append({**by_id(cells, "talker"), "id": "piece", "source": "print('the second half')"})
    submission = read(lab, tmp_path, cells)
    assert codes(submission) == ["split-cell"] and "merge the pieces" in submission.problems[0].because
    cells[-1]["source"] = "\n"
    assert codes(read(lab, tmp_path, cells)) == []


def test_a_copy_of_an_answer_that_was_turned_into_text_is_no_piece_of_it(lab: Lab, tmp_path: Path) -> None:
    cells = json.loads(json.dumps(solved(lab)))
    cells.append({**by_id(cells, "talker"), "id": "old", "cell_type": "markdown"})
    assert codes(read(lab, tmp_path, cells)) == []


def test_the_labs_own_source_is_a_notebook_without_defects(lab: Lab, tmp_path: Path) -> None:
    assert "HIDDEN TESTS" in json.dumps(lab.raw)
    submission = read(lab, tmp_path, lab.raw["cells"])
    assert submission.readable and codes(submission) == []


def test_a_given_program_cannot_be_replaced(lab: Lab, tmp_path: Path) -> None:
    submission = read(lab, tmp_path, solved(lab, talker="%%node helper\nprint('mine')"))
    assert submission.files["helper.py"] == "# %%node helper\nprint('given')\n"


@pytest.mark.parametrize(
    ("content", "code"),
    [
        ("", "no-notebook"),
        ("{", "not-json"),
        ("[" * 100_000, "not-json"),
        ('{"nbformat": 4, "cells": ' + "9" * 5000 + "}", "not-json"),
        ("[]", "not-a-notebook"),
        ('{"nbformat": 3, "worksheets": []}', "not-a-notebook"),
        ('{"nbformat": 4, "cells": [1]}', "not-a-notebook"),
        ('{"nbformat": 4, "cells": []}', "wrong-notebook"),
        ('{"nbformat": 4, "cells": [{"metadata": [], "source": null}]}', "wrong-notebook"),
        (" " * NOTEBOOK_BYTES + "{}", "oversized-notebook"),
    ],
)
def test_what_is_no_notebook_of_the_lab(lab: Lab, tmp_path: Path, content: str, code: str) -> None:
    submission = read(lab, tmp_path, content)
    assert (codes(submission), submission.readable) == ([code], False)


def test_a_link_or_a_fifo_is_not_read(lab: Lab, tmp_path: Path) -> None:
    real = toy.hand_in(tmp_path, "ann", solved(lab))
    link = tmp_path / "link.ipynb"
    link.symlink_to(real)
    fifo = tmp_path / "fifo.ipynb"
    os.mkfifo(fifo)
    for path in (link, fifo, tmp_path / "missing.ipynb", tmp_path):
        assert codes(read_submission(path, lab)) == ["no-notebook"]


@pytest.mark.parametrize("level", ["student", "lab"])
def test_a_link_in_place_of_a_folder_of_a_submission_is_not_followed(lab: Lab, tmp_path: Path, level: str) -> None:
    other = toy.hand_in(tmp_path / "submitted" / "ann", toy.LAB, solved(lab))
    links = {"student": tmp_path / "submitted" / "eve", "lab": tmp_path / "submitted" / "eve" / toy.LAB}
    links[level].parent.mkdir(exist_ok=True)
    links[level].symlink_to({"student": other.parent.parent, "lab": other.parent}[level])
    assert codes(read_submission(tmp_path / "submitted" / "eve" / toy.LAB / other.name, lab)) == ["no-notebook"]
    assert codes(read_submission(other, lab)) == []


def test_half_characters_are_replaced(lab: Lab, tmp_path: Path) -> None:
    text = json.dumps(toy.notebook(solved(lab, talker="%%node talker\nprint('X')"))).replace("'X'", "'\\ud800'")
    submission = read(lab, tmp_path, text)
    assert submission.files["talker.py"] == "# %%node talker\nprint('?')\n"


def test_the_digest_follows_the_answers_and_the_lab(lab: Lab, tmp_path: Path) -> None:
    digest = read(lab, tmp_path, solved(lab)).digest
    assert read(lab, tmp_path, solved(lab)).digest == digest
    assert read(lab, tmp_path, solved(lab, why="Other.")).digest != digest
    path = lab.notebook
    path.write_text(path.read_text().replace("secret = 0", "secret = 1"))
    changed = load_lab(path.parent.parent.parent, toy.LAB)
    assert read(changed, tmp_path, solved(changed)).digest != digest


def test_the_digest_follows_the_kit(lab: Lab, tmp_path: Path) -> None:
    shutil.copytree(ROOT / "autograder", tmp_path / "autograder", ignore=shutil.ignore_patterns("__pycache__"))
    path = toy.hand_in(tmp_path, "ann", solved(lab))
    command = (
        "import sys; from pathlib import Path\n"
        "from autograder.submission import reader; from autograder.course import lab\n"
        "print(reader.read_submission(Path(sys.argv[1]), lab.load_lab(Path(sys.argv[2]), sys.argv[3])).digest)"
    )

    def digest() -> str:
        arguments = [str(path), str(lab.notebook.parent.parent.parent), toy.LAB]
        run = [sys.executable, "-c", command, *arguments]
        environment = os.environ | {"PYTHONPATH": str(tmp_path)}
        return subprocess.check_output(run, cwd=tmp_path, env=environment, text=True).strip()

    assert digest() == read(lab, tmp_path, solved(lab)).digest
    check = tmp_path / "autograder" / "checks" / "launch.py"
    check.write_text(check.read_text() + "# changed\n")
    assert digest() != read(lab, tmp_path, solved(lab)).digest


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(
        ["cells", "nbformat", "metadata", "nbgrader", "grade_id", "source", "cell_type", "solution", "locked"]
    ), inner, max_size=4),
    max_leaves=20,
)  # fmt: skip
marks = st.fixed_dictionaries({"nbgrader": json_values | st.fixed_dictionaries({"grade_id": st.just("talker")})})
cell_values = json_values | st.fixed_dictionaries({"metadata": json_values | marks, "source": json_values})


@given(cells=st.lists(cell_values, max_size=4))
def test_no_notebook_can_stop_the_reader(cells: Any, tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("any")
    lab = load_lab(toy.make_course(folder / "course"), toy.LAB)
    submission = read(lab, folder, json.dumps({"nbformat": 4, "cells": cells}))
    assert submission.sources.keys() == lab.answers.keys()


class OnlyItself(dict[str, Any]):
    """A cell that must not be compared with others."""

    def __eq__(self, other: object) -> bool:
        raise AssertionError("two cells were compared")

    __hash__ = None  # type: ignore[assignment]


def test_copies_of_a_cell_are_not_compared_with_each_other() -> None:
    """Of the ninety thousand that a notebook can hold, that would take the better part of an hour."""
    copies = [OnlyItself(plain_cell(f"%%node talker\n#{number}")) for number in range(3)]
    piece = OnlyItself(plain_cell("print('split off')"))
    assert [id(cell) for cell in pieces_of([*copies, piece], "talker.py")] == [id(piece)]
