"""What students get: nothing in it tells a solution, and it works from an unpacked zip."""

from __future__ import annotations

import ast
import hashlib
import io
import json
import os
import re
import shutil
import subprocess
import sys
import time
import tomllib
import urllib.error
import urllib.request
import zipfile
from pathlib import Path

import pytest
import toy
from checkouts import ENVIRON, make, write_lock
from linked import link_tree
from places import ROOT
from served import address_of

from autograder.authoring.classroom50 import write_classroom50
from autograder.authoring.student_kit import NAME, write_kit
from autograder.core.errors import KitError
from autograder.course.lab import lab_names


@pytest.fixture(scope="module")
def course(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A course of one small lab, released."""
    from autograder.authoring.release import START_PAGE, release, start_page

    root = toy.make_course(tmp_path_factory.mktemp("toy"))
    release(root, toy.LAB)
    (root / "labs" / START_PAGE).write_text(start_page(root / "labs"), encoding="utf-8")
    return root


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """All that is in the zip of this course, and in the wheel in it, by name."""
    with zipfile.ZipFile(write_kit(ROOT, None, tmp_path_factory.mktemp("release"))) as archive:
        found = {name: archive.read(name) for name in archive.namelist()}
    wheel = next(name for name in found if name.endswith(".whl"))
    with zipfile.ZipFile(io.BytesIO(found.pop(wheel))) as archive:
        found |= {f"{wheel}/{name}": archive.read(name) for name in archive.namelist()}
    return {name: content.decode("utf-8") for name, content in found.items()}


def test_the_kit_says_which_section_of_the_lectures_explains_which_reason(files: dict[str, str]) -> None:
    given = tomllib.loads(files[f"{NAME}/kit/course.toml"])
    own = tomllib.loads((ROOT / "course.toml").read_text(encoding="utf-8"))
    assert given["sections"] and given == own


def cells(notebook: Path) -> list[str]:
    return ["".join(cell["source"]) for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]]


def regions(source: str, mark: str) -> list[str]:
    return re.findall(rf"BEGIN {mark}[^\n]*\n(.*?)\n[^\n]*END {mark}", source, re.DOTALL)


def test_no_solution_hidden_test_expected_value_or_mark_scheme_is_in_it(files: dict[str, str]) -> None:
    everything = {
        name: "\n".join(cell for cell in map("".join, (one["source"] for one in json.loads(text)["cells"])))
        if name.endswith(".ipynb")
        else text
        for name, text in files.items()
    }
    seen = dict.fromkeys(("solutions", "tests", "answers"), 0)
    for lab in lab_names(ROOT):
        given = "\n".join(cells(ROOT / "labs" / lab / f"{lab}.ipynb"))
        raw = json.loads((ROOT / "solutions" / lab / f"{lab}.ipynb").read_text(encoding="utf-8"))
        for cell in raw["cells"]:
            source = "".join(cell["source"])
            secrets = [("solutions", region) for region in regions(source, "SOLUTION")]
            for mark in ("HIDDEN TESTS", "MARK SCHEME"):
                # Line by line: expected values stand in them.
                secrets += [("tests", line) for region in regions(source, mark) for line in region.split("\n")]
            if cell["cell_type"] == "markdown" and cell["metadata"].get("nbgrader", {}).get("solution"):
                secrets += [("answers", line) for line in source.split("\n")]
            for kind, secret in secrets:
                if len(secret.strip()) > 20 and secret.strip() not in given:
                    seen[kind] += 1
                    assert [name for name, text in everything.items() if secret.strip() in text] == [], secret
    assert min(seen.values()) > 5, seen
    for name, text in files.items():
        if name.endswith(".ipynb"):
            assert not re.search(r"### (BEGIN|END) |BEGIN (SOLUTION|HIDDEN|MARK)", text), name
    for part in ("solutions/", "tests/", "autograder/authoring/", "autograder/gradebook/", "autograder/intake/collect"):
        assert not [name for name in files if part in name]


def test_the_wheel_lacks_nothing_that_it_imports(files: dict[str, str]) -> None:
    modules = {
        name.split(".whl/")[1].removesuffix(".py").removesuffix("/__init__").replace("/", "."): text
        for name, text in files.items()
        if ".whl/" in name and name.endswith(".py")
    }
    for name, text in modules.items():
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("autograder"):
                wanted = {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
                assert wanted & modules.keys(), f"{name} imports {node.module}"


def test_the_wheel_brings_nbgraders_configuration_along(files: dict[str, str]) -> None:
    """It puts the kit's way of validating in place of nbgrader's, which runs notebooks and shows the checks' source."""
    (config,) = [text for name, text in files.items() if name.endswith("/etc/jupyter/nbgrader_config.py")]
    assert "use_own_course(get_config())" in config and "gradebook" not in config


def test_no_file_of_the_kit_names_a_package_host(files: dict[str, str]) -> None:
    from foreign import FOREIGN

    assert [name for name, text in files.items() if FOREIGN.search(text)] == []


def test_the_files_for_other_platforms_can_be_read_and_name_what_there_is(files: dict[str, str]) -> None:
    """Nobody has run them on those platforms here; what they say is at least there."""
    import yaml
    from typer.main import get_command

    from autograder.cli.main import app

    there = {name.removeprefix(f"{NAME}/"): text for name, text in files.items()}
    workflow_file, container = ".github/workflows/check.yml", ".devcontainer/devcontainer.json"
    settings = json.loads(re.sub(r"^\s*//.*$", "", there[container], flags=re.MULTILINE))
    (job,) = yaml.safe_load(there[workflow_file])["jobs"].values()
    scripts = [settings["postCreateCommand"], *(step["run"] for step in job["steps"] if "run" in step)]
    for script in scripts:
        assert subprocess.run(["bash", "-n"], input=script, text=True, capture_output=True).stderr == ""
    instructions = re.sub(r"\\\n", " ", there["binder/Dockerfile"]).splitlines()
    words = {line.split()[0] for line in instructions if line and not line.startswith("#")}
    assert words <= {"FROM", "ARG", "RUN", "WORKDIR", "USER", "COPY", "ENV"}

    targets = set(re.findall(r"^([a-z]+):", there["Makefile"], re.MULTILINE))
    check = get_command(app).commands["check"]  # type: ignore[attr-defined]
    options = {option for parameter in check.params for option in parameter.opts}
    told = "\n".join([there["README.md"], there["binder/Dockerfile"], *scripts])
    assert set(re.findall(r"\bmake ([a-z]+)\b(?!-)", told)) <= targets
    assert "--github" in options and "autograder check" in there[workflow_file]
    for path in re.findall(r"(?:[\w.-]+/)+[\w*.-]+\.(?:md|yml|ipynb|whl|json)|`[\w.]+/[\w.]+`", told):
        pattern = re.sub("lab/tree/|REPOSITORY/", "", path.strip("`"))
        if not pattern.startswith((".venv", "mybinder.org")):
            assert any(Path(name).match(pattern) or name.startswith(f"{pattern}/") for name in there), pattern


def test_a_lab_that_would_tell_its_solution_is_not_given_out(course: Path, tmp_path: Path) -> None:
    root = shutil.copytree(course, tmp_path / "course")
    told = [{**cell, "source": re.sub(r"###.*\n", "", str(cell["source"]))} for cell in toy.CELLS]
    (root / "labs" / "toy" / "notes.json").write_text(json.dumps(toy.notebook(told)), encoding="utf-8")
    (root / "labs" / "toy" / "hints.md").write_text(
        'ros.program("talker").expect_exit(status=secret, hint="Mind the status.")'
    )
    with pytest.raises(KitError, match=r"hints\.md: a hidden test of toy") as refused:
        write_kit(root, None, tmp_path / "out")
    assert "Nothing was written" in refused.value.do
    assert not list((tmp_path / "out").rglob("*.ipynb"))


def the_book_is_served(kit: Path, tmp_path: Path) -> None:
    """To who is logged in, with nothing else of the kit below its address."""
    log = tmp_path / "jupyter.log"
    options = ["--no-browser", "--ServerApp.port=0", "--ServerApp.ip=127.0.0.1", "--IdentityProvider.token=lab"]
    options += ["--allow-root"] if os.getuid() == 0 else []
    environment = ENVIRON | {"HOME": str(tmp_path), "JUPYTER_RUNTIME_DIR": str(tmp_path / "runtime")}
    with log.open("w") as file:
        server = subprocess.Popen(
            [kit / ".venv" / "bin" / "autograder", "jupyter", *options],
            cwd=kit, env=environment, stdout=file, stderr=file,
        )  # fmt: skip
    try:
        address = address_of(server, tmp_path / "runtime", log)
        with urllib.request.urlopen(f"{address}lectures/index.html?token=lab", timeout=300) as answer:
            assert answer.read() == b"<h1>Lectures</h1>"
            assert "sandbox" not in answer.headers["Content-Security-Policy"]
        for path in ("lectures/index.html", "lectures/..%2Fkit/course.toml?token=lab"):
            try:
                with urllib.request.urlopen(address + path, timeout=300) as answer:
                    assert "login" in answer.url
            except urllib.error.HTTPError as error:
                assert error.code in (403, 404)
    finally:
        server.terminate()
        server.wait(timeout=120)


def a_new_version_replaces_no_work(kit: Path, tmp_path: Path) -> None:
    """Unpacked over the old one: what was begun stays, and whoever renames a lab's folder gets the lab anew."""
    lab, notebook = kit / "labs" / "toy", kit / "labs" / "toy" / "toy.ipynb"
    mine = notebook.read_bytes()
    (lab / "notes.md").write_text("mine")
    (kit / "labs" / "README.md").write_text("of an earlier version")
    shutil.rmtree(kit / "kit" / "labs")
    with zipfile.ZipFile(tmp_path / f"{NAME}.zip") as archive:
        archive.extractall(kit.parent)
    handed_out = (kit / "kit" / "labs" / "toy" / "toy.ipynb").read_bytes()
    for once_more in (False, True):
        done = make(kit, "setup")
        assert done.returncode == 0, done.stderr
        assert notebook.read_bytes() == (handed_out if once_more else mine) and handed_out != mine
        assert (kit / "labs" / "README.md").read_bytes() == (kit / "kit" / "labs" / "README.md").read_bytes()
        if not once_more:
            assert (lab / "notes.md").read_text() == "mine"
            lab.rename(lab.with_name("my toy"))
    assert (kit / "labs" / "my toy" / "toy.ipynb").read_bytes() == mine


def test_from_an_unpacked_zip_to_a_verdict(course: Path, tmp_path: Path) -> None:
    book = tmp_path / "book"
    book.mkdir()
    (book / "index.html").write_text("<h1>Lectures</h1>", encoding="utf-8")
    links = (
        '<a href="index.html">Index</a>\n      <a class="to-slides" href="../slides/01_nodes.html">Slides</a>\n'
        'Lecture <a class="internal" href="../slides/01_nodes.html"><span>1</span></a>.\n'
    )
    (book / "01_nodes.html").write_text(links, encoding="utf-8")
    (book / "appendix").mkdir()
    to_teachers = (
        '<a class="reference" href="{}instructors/exam_questions.html#x"><span>Exam</span></a> <a href="#t">t</a>'
    )
    (book / "appendix" / "words.html").write_text(to_teachers.format("../"), encoding="utf-8")
    (book / "search.html").write_text(to_teachers.format(""), encoding="utf-8")
    (book / "instructors").mkdir()
    (book / "instructors" / "exam_questions.html").write_text("<p>Answer: 42</p>", encoding="utf-8")
    with zipfile.ZipFile(write_kit(course, book, tmp_path)) as archive:
        archive.extractall(tmp_path / "für Übungen")
    kit = tmp_path / "für Übungen" / NAME
    page = (kit / "lectures" / "01_nodes.html").read_text(encoding="utf-8")
    assert page == '<a href="index.html">Index</a>\nLecture <span>1</span>.\n', (
        "a link to slides, which students do not get"
    )
    assert not (kit / "lectures" / "instructors").exists(), "exam questions with their answers"
    for place in ("appendix/words.html", "search.html"):
        assert (kit / "lectures" / place).read_text(encoding="utf-8") == '<span>Exam</span> <a href="#t">t</a>'
    write_lock(kit, "requirements.lock", "uv")
    made = make(kit, "setup")
    assert made.returncode == 0, made.stderr
    # All that the lock would have installed comes from this environment, as hard links.
    for name in ("lib", "share"):
        link_tree(Path(sys.prefix, name), kit / ".venv" / name)
    for path in kit.glob(".venv/lib/python*/site-packages/autograder.pth"):
        assert str(ROOT) not in path.read_text()

    notebook = kit / "labs" / "toy" / "toy.ipynb"
    text = notebook.read_text(encoding="utf-8")
    assert "Name a lab" in make(kit, "check").stderr
    blank = make(kit, "check", "LAB=toy")
    assert blank.returncode == 0, blank.stderr  # the report was given, and make has nothing to add
    assert "not attempted yet" in blank.stdout and "own copy" not in blank.stderr

    solved = text.replace("# YOUR CODE HERE", "print('hello')", 1)
    # The student's own copy of a check does not count, only the one that was handed out.
    notebook.write_text(solved.replace("table.expect_answer", "table.expect_answr"), encoding="utf-8")
    again = make(kit, "--no-print-directory", "check", "LAB=toy", "ARGS=--json")
    result = json.loads(again.stdout)
    assert [check["points"] for check in result["checks"]] == [3.0, 0.0]

    handed_in = make(kit, "submit", "LAB=toy")
    assert handed_in.returncode == 0, handed_in.stderr
    assert "holds so far The talker" in " ".join(handed_in.stdout.split())
    packed = kit / "handed_in" / "toy.ipynb"
    assert packed.read_bytes() == notebook.read_bytes()
    receipt = packed.with_suffix(".receipt.txt").read_text(encoding="utf-8")
    assert hashlib.sha256(notebook.read_bytes()).hexdigest() in receipt and "of 5 points, and up to 3 more" in receipt

    the_book_is_served(kit, tmp_path)
    a_new_version_replaces_no_work(kit, tmp_path)
    refused = subprocess.run(
        [kit / ".venv" / "bin" / "autograder", "grade", "toy"], cwd=kit, env=ENVIRON, capture_output=True, text=True
    )
    assert refused.returncode == 2 and "No such command 'grade'" in refused.stderr
    assert os.access(kit / ".venv" / "bin" / "ros2", os.X_OK)


def test_submit_says_what_is_unsaved_outdated_ignored_or_empty_and_intake_takes_it(
    course: Path, tmp_path: Path
) -> None:
    from typer.testing import CliRunner

    from autograder.cli.main import app
    from autograder.course.cells import parse
    from autograder.intake.collect import collect
    from autograder.notebook.program_folder import ProgramFolder, Written

    raw = json.loads((course / "labs" / "toy" / "toy.ipynb").read_text(encoding="utf-8"))
    by_id = {cell["metadata"].get("nbgrader", {}).get("grade_id", ""): cell for cell in raw["cells"]}
    by_id["talker"] |= {"source": "%%node talker\nprint('hello')", "execution_count": 7}
    by_id["check_talker"]["execution_count"] = 3
    raw["cells"].append(toy.cell("code", "%%node talker\nprint('mine')", 90))
    notebook = tmp_path / "my toy" / "toy.ipynb"
    notebook.parent.mkdir()
    notebook.write_text(json.dumps(raw), encoding="utf-8")
    file = parse("%%node talker\nprint('hello, all')")
    assert file is not None
    folder = ProgramFolder(notebook, notebook.parent)
    folder.write(Written(file, "", "", 7, time.time()))

    def submit() -> str:
        words = ["submit", str(notebook), "--without-checks", "--course", str(course), "-o", str(tmp_path / "ann")]
        done = CliRunner().invoke(app, words)
        assert done.exit_code == 0, done.output
        return " ".join(done.output.split())

    os.utime(notebook, (0, time.time() - 60))
    told = submit()
    assert "with a text that is not in the saved notebook. Save the notebook" in told
    assert "The cells `%%file answers.yaml`, `why` are still as you received them." in told
    assert "A cell above the check of “The talker” was run again after the check" in told
    assert "`%%node talker`" in told and "ignore" in told
    os.utime(notebook, (0, time.time() + 60))
    assert "has been changed since it was run" in submit()

    taken = collect(tmp_path, "toy", tmp_path / "course")
    assert taken.notebooks["ann"].read_bytes() == notebook.read_bytes()


RUNNER = {
    "CLASSROOM": "robotics",
    "ASSIGNMENT": "toy",
    "SUBMISSION_TAG": "submit/2026-11-20T18-30-00Z-a1b2c3d",
    "COMMIT_URL": "https://git.example/robotics-toy-ann/commit/a1b2c3d",
    "RELEASE_URL": "https://git.example/robotics-toy-ann/releases/tag/submit",
}
"""What Classroom 50's runner says to an autograder."""


def test_classroom50_checks_what_is_pushed_with_the_students_kit(course: Path, tmp_path: Path) -> None:
    made = write_classroom50(course, "toy", tmp_path / "robotics" / "autograders" / "toy")
    assert [path.name for path in made] == ["autograder.py", "kit.zip"]
    with zipfile.ZipFile(made[1]) as archive:
        archive.extractall(tmp_path / "temp" / "students-kit")
    kit = tmp_path / "temp" / "students-kit" / NAME
    write_lock(kit, "requirements.lock", "uv")
    assert make(kit, "setup").returncode == 0
    for name in ("lib", "share"):
        link_tree(Path(sys.prefix, name), kit / ".venv" / name)

    checkout = tmp_path / "robotics-toy-ann"
    shutil.copytree(kit / "labs" / "toy", checkout / "labs" / "toy")
    shutil.copytree(kit / "kit" / "labs", checkout / "kit" / "labs")  # as in a template that holds the whole kit
    notebook = checkout / "labs" / "toy" / "toy.ipynb"
    notebook.write_text(notebook.read_text("utf-8").replace("# YOUR CODE HERE", "print('hello')", 1), "utf-8")
    forged = checkout / "result.json"
    forged.write_text('{"score": 1000}')

    def pushed(**environ: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, made[0]], cwd=checkout, env=ENVIRON | {"RUNNER_TEMP": str(tmp_path / "temp")} | environ,
            capture_output=True, text=True, timeout=300, check=False,
        )  # fmt: skip

    done = pushed(**RUNNER)
    assert done.returncode == 0, done.stderr
    result = json.loads(forged.read_text("utf-8"))
    assert (result["schema"], result["classroom"], result["review"]) == (
        "classroom50/result/v1", "robotics", RUNNER["COMMIT_URL"],
    )  # fmt: skip
    assert (result["score"], result["max-score"]) == (300, 500)
    assert [(test["score"], test["max-score"], test["passed"]) for test in result["tests"]] == [
        (300, 300, True), (0, 200, False),
    ]  # fmt: skip
    assert result["tests"][0]["output"] == "up to 3 points, decided when the lab is graded"
    assert "| The table | 0 of 2 points |" in (checkout / "release-body.md").read_text("utf-8")

    done = pushed()
    assert done.returncode == 1 and "its runner did not set CLASSROOM" in done.stderr and not forged.exists()
    notebook.rename(notebook.with_name("a.ipynb"))
    shutil.copy(notebook.with_name("a.ipynb"), notebook.with_name("b.ipynb"))
    done = pushed(**RUNNER)
    assert done.returncode == 1 and "labs/toy/a.ipynb, labs/toy/b.ipynb" in done.stderr and not forged.exists()
