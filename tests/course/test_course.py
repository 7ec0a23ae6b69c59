"""Labs as the instructor wrote them: their cells, the files these name, what students see; and a course's settings."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import toy

from autograder.core.errors import KitError
from autograder.course.cells import BadNameError, hidden_lines, parse, without_hidden_tests
from autograder.course.lab import Lab, load_lab
from autograder.course.settings import read_book, read_settings


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return load_lab(toy.make_course(tmp_path / "course"), toy.LAB)


@pytest.mark.parametrize(
    ("source", "name"),
    [
        ("%%node talker\nx = 1", "talker.py"),
        ("\n\n%%node talker_2  \nx", "talker_2.py"),
        ("%%file a.yaml\nb: 1", "a.yaml"),
        ("%%file camera.params.yml\n", "camera.params.yml"),
        ("%%file Table-1.csv\n", "Table-1.csv"),
    ],
)
def test_a_cell_names_its_file(source: str, name: str) -> None:
    file = parse(source)
    assert file is not None and file.file_name == name


@pytest.mark.parametrize(
    "source", ["", "x = 1", "# %%node talker", "x\n%%node talker", "%%nodes talker", "%node talker"]
)
def test_a_cell_without_the_magic_is_no_file(source: str) -> None:
    assert parse(source) is None


@pytest.mark.parametrize(
    "line",
    [
        "%%node", "%%node ../talker", "%%node talker.py", "%%node Talker", "%%node 2talker", "%%node a b",
        "%%node talker # mine", "%%node täl", "%%file", "%%file a.py", "%%file /etc/passwd.yaml", "%%file ../a.yaml",
        "%%file a/b.yaml", "%%file a\\b.yaml", "%%file .yaml", "%%file .hidden.yaml", "%%file a.yaml.py",
        "%%file -rf.yaml", "%%file a\x00.yaml", "%%file " + "a" * 300 + ".yaml",
        "%%file a" + ".bbbbbbbb" * 28 + ".yaml", "%%node a" + " " * 60_000 + "b",
    ],
)  # fmt: skip
def test_a_bad_name_is_refused_with_a_reason(line: str) -> None:
    with pytest.raises(BadNameError, match="name"):
        parse(f"{line}\nx")


def test_the_lab_knows_its_cells(lab: Lab) -> None:
    assert [(cell.grade_id, cell.title, cell.points) for cell in lab.cells] == [
        ("setup", "A toy lab", None),
        ("check_talker", "The talker", 3),
        ("check_answers", "The table", 2),
    ]
    assert lab.given == {"helper.py": "# %%node helper\nprint('given')\n"}
    assert list(lab.answers) == ["talker", "answers", "why"]
    assert (lab.max_points, lab.answers["why"].points) == (5, 4)
    assert "secret" in lab.checks[0].source
    assert "secret" not in json.dumps(lab.released) and "hello" not in json.dumps(lab.released)


def test_an_unknown_lab_is_named_with_those_there_are(lab: Lab) -> None:
    with pytest.raises(KitError, match=r"no lab `nowhere`.*\n.*toy"):
        load_lab(lab.notebook.parent.parent.parent, "nowhere")


def test_without_solutions_the_released_lab_serves(lab: Lab, tmp_path: Path) -> None:
    path = tmp_path / "student" / "labs" / "toy" / "toy.ipynb"
    path.parent.mkdir(parents=True)
    path.write_text(json.dumps(toy.notebook(list(lab.released))))
    released = load_lab(tmp_path / "student", "toy")
    assert [cell.grade_id for cell in released.cells] == [cell.grade_id for cell in lab.cells]
    assert released.answers["talker"].blank == lab.answers["talker"].blank


def test_lines_are_hidden_that_are_cut_from_what_students_receive() -> None:
    source = "a\n# BEGIN HIDDEN TESTS\nb\n# END HIDDEN TESTS\nc"  # nbgrader asks for no more than these words
    assert "b" not in without_hidden_tests(source).split("\n")
    assert 3 in hidden_lines(source.split("\n")) and not {1, 5} & hidden_lines(source.split("\n"))


def test_a_setting_that_there_is_not_is_refused(tmp_path: Path) -> None:

    (tmp_path / "course.toml").write_text('titel = "Robots"\n')
    with pytest.raises(KitError, match=r"`titel`, which is not a setting of a course[^\n]*\nSettings: title, labs"):
        read_settings(tmp_path)
    (tmp_path / "course.toml").write_text("labs = 3\n")
    with pytest.raises(KitError, match="`labs` cannot be 3"):
        read_settings(tmp_path)


def test_sections_name_lectures_that_there_are_and_each_code_once(tmp_path: Path) -> None:

    (tmp_path / "course.toml").write_text(
        '[lectures]\n"Week 3" = "names"\n[sections."Week 3"]\n"Two names?" = ["duplicate-node"]\n'
    )
    book = read_book(tmp_path)
    assert str(book.sections["duplicate-node"]) == "Week 3, section 'Two names?'"
    assert book.sections["duplicate-node"].place == "names.html#two-names"
    assert str(book.named_in("Compare them; week 3, section 'A topic'.")) == "Week 3, section 'A topic'"
    assert book.named_in("Lecture 3, section 'A topic'") is None
    (tmp_path / "course.toml").write_text('[sections."Week 3"]\nNames = ["duplicate-node"]\n')
    with pytest.raises(KitError, match="a lecture that `lectures` does not have, 'Week 3'"):
        read_book(tmp_path)
    (tmp_path / "course.toml").write_text('[lectures]\nA = "a"\n[sections.A]\nB = ["x"]\nC = ["x"]\n')
    with pytest.raises(KitError, match="the code 'x' in two sections"):
        read_book(tmp_path)
