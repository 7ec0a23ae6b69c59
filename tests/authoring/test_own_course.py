"""A course of one's own: the kit installed from its wheel, far from any checkout, takes a course the whole way."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from own_environment import Environment
from places import ROOT
from typer.testing import CliRunner

from autograder.authoring.courses import new_course
from autograder.cli.main import app
from autograder.core.errors import KitError
from autograder.core.version import VERSION
from autograder.course.paths import CoursePaths
from autograder.gradebook.own_courses import TEMPLATE, trust
from autograder.gradebook.settings import gradebook_address, settings_of

LAB = "lab2_talkers"


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Environment:
    return Environment(tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def course(environment: Environment, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A course with two labs, released."""
    root = tmp_path_factory.mktemp("own") / "my course"
    next_ = environment.run(root.parent, "autograder", "new", "course", root)
    assert f"  cd '{root}'\n" in next_
    told = environment.run(root, "autograder", "new", "lab", LAB)
    assert "the program `greeter`" in told and "canaries.yaml" in told and f"autograder lint {LAB}\n" in told
    told = environment.run(root, "autograder", "release")
    assert f"{LAB} → {root}/labs/{LAB}" in told
    return root


def sources(notebook: Path) -> list[str]:
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    return ["".join(cell["source"]) for cell in cells]


def hand_in(course: Path, folder: Path, student: str, *, solved: bool) -> Path:
    """Write a student's notebook: as it is given out, or with the author's solution in it."""
    kind = "solutions" if solved else "labs"
    path = folder / student / f"{LAB}.ipynb"
    path.parent.mkdir(parents=True)
    notebook = json.loads((course / kind / LAB / f"{LAB}.ipynb").read_text(encoding="utf-8"))
    path.write_text(json.dumps(notebook), encoding="utf-8")
    return path


def test_nothing_of_the_checkout_is_used(environment: Environment, tmp_path: Path) -> None:
    told = environment.run(tmp_path, "python", "-c", "import autograder, sys; print(autograder.__file__, *sys.path)")
    assert str(ROOT) not in told
    etc = environment.folder / "etc"
    for name in ("jupyter/nbgrader_config", "jupyter/jupyter_nbconvert_config", "ipython/ipython_kernel_config"):
        assert list(etc.glob(f"{name}.*")), name


def test_a_new_lab_lints_clean_and_hides_its_solution(environment: Environment, course: Path) -> None:
    assert environment.run(course, "autograder", "lint", LAB) == f"{LAB}: fine\n"
    released = sources(course / "labs" / LAB / f"{LAB}.ipynb")
    assert "# YOUR CODE HERE" in released[3] and "create_publisher" not in released[3]
    assert f"({LAB}/{LAB}.ipynb)" in (course / "labs" / "README.md").read_text(encoding="utf-8")


def test_lint_runs_the_solution_and_says_which_check_it_fails(environment: Environment, tmp_path: Path) -> None:
    root = tmp_path / "course"
    environment.run(tmp_path, "autograder", "new", "course", root)
    notebook = root / "solutions" / "lab1_greeter" / "lab1_greeter.ipynb"
    text = notebook.read_text(encoding="utf-8")
    notebook.write_text(text.replace("messages_in_two_seconds: 10", "messages_in_two_seconds: 11"), encoding="utf-8")
    told = environment.run(root, "autograder", "lint", status=1)
    assert "error: cell `check_facts`: the solution gets 1 of 2 points." in told
    assert told.count("error: ") == 1


def test_a_class_is_graded_and_a_notebook_checked(environment: Environment, course: Path, tmp_path: Path) -> None:
    class_ = tmp_path / "class"
    solved = hand_in(course, class_, "ann", solved=True)
    hand_in(course, class_, "bob", solved=False)
    environment.run(tmp_path, "autograder", "grade", LAB, class_, "--course", course)
    table = (course / "build" / "grades.csv").read_text(encoding="utf-8").splitlines()
    assert table[1:] == [f"ann,{LAB},5,5,0", f"bob,{LAB},0,5,0"]
    assert (course / "build" / "feedback" / "bob" / LAB / f"{LAB}.html").is_file()
    environment.run(tmp_path, "autograder", "check", solved, "--course", course)
    # Never the course that a notebook happens to lie in: its checks are code.
    assert "--course FOLDER" in environment.run(course, "autograder", "check", solved, status=2)


def test_nbgraders_own_settings_of_a_course_hold_everywhere(environment: Environment, tmp_path: Path) -> None:
    root = tmp_path / "course"
    environment.run(tmp_path, "autograder", "new", "course", root)
    config = root / "nbgrader_config.py"
    address = f"sqlite:///{tmp_path}/elsewhere.db"
    lines = f"\nget_config().CourseDirectory.db_url = {address!r}  # noqa: F821\n"
    config.write_text(config.read_text(encoding="utf-8") + lines, encoding="utf-8")
    environment.run(root, "autograder", "new", "lab", LAB)
    hand_in(root, tmp_path / "class", "ann", solved=True)
    told = environment.run(root, "autograder", "grade", LAB, tmp_path / "class")
    assert f"gradebook  {tmp_path}/elsewhere.db" in told
    assert (tmp_path / "elsewhere.db").is_file() and not (root / "gradebook" / "gradebook.db").exists()
    assert f"ann,{LAB},5,5,0" in (root / "build" / "grades.csv").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("address", "told"),
    [
        ("gradebook.db", "not the address of a gradebook"),
        ("mysql+nodriver://h/db", "not the address"),
        ("mysql://h/db", "driver"),
    ],
)
def test_an_address_that_no_gradebook_can_have_is_said_to_be_one(address: str, told: str, tmp_path: Path) -> None:
    (tmp_path / "nbgrader_config.py").write_text(
        f"get_config().CourseDirectory.db_url = {address!r}\n", encoding="utf-8"
    )
    trust(tmp_path)
    with pytest.raises(KitError) as refused:
        gradebook_address(tmp_path)
    assert told in refused.value.what and "nbgrader_config.py" in refused.value.what and refused.value.do


def test_settings_in_a_folder_that_nobody_called_a_course_are_no_program_to_run(tmp_path: Path) -> None:
    """As in an unpacked submission, which can look like a course."""
    config = tmp_path / "nbgrader_config.py"
    config.write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\n", encoding="utf-8")
    for read in (settings_of, gradebook_address):
        with pytest.raises(KitError) as refused:
            read(tmp_path)
        assert f"autograder trust {tmp_path}" in refused.value.do and not (tmp_path / "ran").exists()


def test_a_course_is_begun_in_no_folder_that_holds_something_and_keeps_grades_out_of_git(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(KitError, match="file is a file"):
        new_course(tmp_path / "file")
    with pytest.raises(KitError, match="is not empty"):
        new_course(tmp_path)
    course = tmp_path / "a course"
    new_course(course)
    subprocess.run(["git", "init", "--quiet", course], check=True)
    paths = CoursePaths(course)
    for path in (paths.gradebook, paths.results, course / "handed_in" / "lab1_greeter_ann.ipynb"):
        assert subprocess.run(["git", "-C", course, "check-ignore", "--quiet", path]).returncode == 0, path


def test_a_course_is_begun_where_nothing_can_be_noted_about_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "config").write_text("a file, so that no folder can be made here")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    done = CliRunner().invoke(app, ["new", "course", str(tmp_path / "course")])
    assert done.exit_code == 0, done.output
    assert f"autograder trust {tmp_path / 'course'}" in done.output.replace("\n", " ") and "Next:" in done.output


def test_the_doctor_speaks_of_the_course_and_of_no_checkout(environment: Environment, course: Path) -> None:
    told = environment.run(course, "autograder", "doctor", "--json")
    findings = {one["name"]: one for one in json.loads(told)["findings"]}
    assert findings["environment"]["found"] == f"{environment.folder} (kit {VERSION})"
    assert str(course) in findings["free space"]["found"]
    assert "make " not in told


def test_students_settings_of_jupyterlab_come_with_the_wheel(environment: Environment, course: Path) -> None:
    shown = environment.run(course, "autograder", "jupyter", "--show-config")
    assert "/lab/tree/README.md" in shown and "'nbgrader.server_extensions.formgrader': False" in shown


def test_the_wheel_has_the_version_that_the_changelog_prepares(environment: Environment) -> None:
    assert next(environment.folder.parent.glob(f"*-{VERSION}-*.whl"))
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.findall(r"^## (\S+)", changes, re.MULTILINE)[0] == VERSION


def test_outside_of_a_course_nbgrader_executes_nothing(environment: Environment, tmp_path: Path) -> None:
    notebook = tmp_path / "toy.ipynb"
    cell = {"cell_type": "code", "id": "a", "metadata": {}, "source": "open('executed', 'w')", "outputs": [],
            "execution_count": None}  # fmt: skip
    notebook.write_text(json.dumps({"cells": [cell], "metadata": {}, "nbformat": 4, "nbformat_minor": 5}))
    (tmp_path / "argcomplete.py").write_text("open('executed', 'w')\n")  # nbgrader looks for it here
    told = environment.run(tmp_path, "python", "-m", "nbgrader", "validate", notebook)
    assert "Start it in the folder of your course" in told and not (tmp_path / "executed").exists()


@pytest.mark.parametrize(
    ("cell", "old", "new", "said"),
    [
        ("check_greeter", ").expect()", ").expct()", "there is no `expct`; `expect` may be meant"),
        ("check_greeter", 'launch("greeter"', 'launch("greter"', "no cell `%%node greter`; `greeter` may be meant"),
        ("check_greeter", "ros.node", "ros.nod", "there is no `nod`; `node` may be meant"),
        ("check_greeter", "ros.node(", "one, two = ros.node('/one'), 2; one.expct(); ros.node(", "there is no `expct`"),
        ("check_greeter", "with launch(", "def own(ros):\n    ros.nod('/one')\n\nwith launch(", "there is no `nod`"),
        ("check_greeter", "at_least=3", "at_last=3", "`expect_messages` has no argument `at_last`; `at_least` may be"),
        (
            "check_greeter",
            "String).expect_messages(at_least=3",
            "Strnig).expect_messages(at_least=3",
            "the name `Strn",
        ),
        ("check_greeter", '{"the text": 2,', '{"the text": 3,', "its score gives 4 points, but its metadata 3"),
        ("check_greeter", '"five times a second": 1}', '"six": 1}', 'no points for the part "five times a second"'),
        (
            "check_greeter",
            '"five times a second": 1}',
            '"six": 1}',
            'gives points for "six", but there is no such part',
        ),
        (  # the last part would break if the first one failed
            "check_greeter",
            'with ros.part("the text"):',
            'with ros.part("the text"):\n        came = 5\n    with ros.part("five times a second"):\n'
            '        ros.require(came, "It came", because="It did not come.")\n    with ros.part("the text"):',
            "`came` is set only in a block above, which ends early if something in it fails",
        ),
        ("check_greeter", '("/greeter")', '("greeter")', "takes full names, but `greeter` does not begin with a slash"),
        ("check_facts", "table.score(2)", "", "it has no score"),
        ("check_facts", "table.score(2)", "table.score(2", "was never closed"),
        ("greeter", "### END SOLUTION", "", "`BEGIN SOLUTION` is inside the one that begins in line"),
        ("greeter", "%%node greeter", "# greeter", "its first line must be `%%node NAME`"),
        ("greeter", '"""Publish one greeting."""', "", "what students receive is not valid Python"),
    ],
)
def test_release_refuses_a_broken_cell_and_names_it(
    course: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cell: str, old: str, new: str, said: str
) -> None:
    from autograder.authoring.release import release
    from autograder.core.errors import KitError

    shutil.copytree(course, tmp_path / "course", ignore=shutil.ignore_patterns("build", "labs"))
    notebook = tmp_path / "course" / "solutions" / LAB / f"{LAB}.ipynb"
    raw = json.loads(notebook.read_text(encoding="utf-8"))
    source = next(one for one in raw["cells"] if one["metadata"].get("nbgrader", {}).get("grade_id") == cell)
    assert old in source["source"]
    source["source"] = source["source"].replace(old, new, 1)
    notebook.write_text(json.dumps(raw), encoding="utf-8")
    with pytest.raises(KitError) as refused:
        release(tmp_path / "course", LAB)
    assert f"cell `{cell}`: " in refused.value.what and said in refused.value.what
    assert not (tmp_path / "course" / "labs").exists()


def test_labs_come_in_the_order_of_the_settings(course: Path, tmp_path: Path) -> None:
    from autograder.authoring.release import start_page
    from autograder.course.lab import lab_names

    root = shutil.copytree(course, tmp_path / "course", ignore=shutil.ignore_patterns("build"))
    (root / "course.toml").write_text(f'title = "Robots"\nlabs = ["{LAB}"]\n')
    assert lab_names(root) == [LAB, "lab1_greeter"]
    page = start_page(root / "labs")
    assert page.startswith("# Robots\n") and page.index(f"{LAB}.ipynb") < page.index("lab1_greeter.ipynb")


def test_a_course_that_lists_a_lab_or_a_code_that_there_is_not_is_told_so(course: Path, tmp_path: Path) -> None:
    root = shutil.copytree(course, tmp_path / "course", ignore=shutil.ignore_patterns("build"))
    sections = '[lectures]\nA = "a"\n[sections.A]\nB = ["topic-nam", "topic-name"]\n'
    (root / "course.toml").write_text(f'labs = ["lab1_greeting", "{LAB}"]\n{sections}')
    lint = [Path(sys.executable).with_name("autograder"), "lint", "--static", "--course", root]
    done = subprocess.run(lint, capture_output=True, text=True)
    assert "error: course.toml lists the lab `lab1_greeting`, which does not exist." in done.stdout.splitlines()
    assert "error: course.toml explains the reason `topic-nam`, which no check gives." in done.stdout.splitlines()
    assert "`topic-name`" not in done.stdout
    assert done.returncode == 1 and done.stderr == ""
    assert subprocess.run([*lint, LAB], capture_output=True).returncode == 0


def test_lint_asks_for_a_sentence_above_each_check(course: Path, tmp_path: Path) -> None:
    root = tmp_path / "course"
    shutil.copytree(course, root, ignore=shutil.ignore_patterns("build"))
    notebook = root / "solutions" / LAB / f"{LAB}.ipynb"
    raw = json.loads(notebook.read_text(encoding="utf-8"))
    raw["cells"] = [one for one in raw["cells"] if one["id"] != "about-check-facts"]
    notebook.write_text(json.dumps(raw), encoding="utf-8")
    lint = [Path(sys.executable).with_name("autograder"), "lint", "--static", "--course", root, LAB]
    told = subprocess.run(lint, capture_output=True, text=True).stdout
    assert "cell `check_facts`: students see it folded" in " ".join(told.split())


def test_this_repositorys_configuration_is_what_a_new_course_gets() -> None:
    assert (ROOT / "nbgrader_config.py").read_text() == TEMPLATE.read_text()
