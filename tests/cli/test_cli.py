"""The command from outside: exit status, what it prints, what it writes."""

from __future__ import annotations

import contextlib
import csv
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

import forked_command
import psutil
import pytest
import toy
from junitparser import JUnitXml
from jupyter_server.services.contents.fileio import atomic_writing
from kill_anything import in_shared_memory
from places import ROOT

from autograder.core.files import only_one, remove_unfinished, write_beside
from autograder.core.results import CheckResult, Isolation, Outcome, Status, SubmissionResult
from autograder.course.lab import load_lab
from autograder.course.paths import CoursePaths
from autograder.report.github import commands, summary
from autograder.sandbox.isolation import preflight
from autograder.sandbox.scratch import Scratch

MAIN = "import sys; sys.argv[0] = 'autograder'; from autograder.cli import main; main()"
STUCK = "import time\ntime.sleep(1000)"


def start(root: Path, *arguments: str, **more: object) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", MAIN, *arguments],
        cwd=root, env=os.environ | {"PYTHONPATH": str(ROOT)}, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, **more,
    )  # type: ignore[call-overload, no-any-return]  # fmt: skip


def run(root: Path, *arguments: str) -> tuple[int, str, str]:
    done = forked_command.run(root, *arguments)
    assert "Traceback" not in done.stderr, done.stderr
    return done.returncode, done.stdout, done.stderr


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A course with a class of four, in a path with a space."""
    root = toy.make_course(tmp_path_factory.mktemp("cli") / "a course")
    for student, talker in (("ann", "print('hello')"), ("bob", "1 / 0"), ("cem", "print('hello'")):
        hand_in(root, student, talker)
    toy.hand_in(root / "class", "dan", "{")
    return root


def hand_in(root: Path, student: str, talker: str) -> Path:
    sources = {"talker": f"%%node talker\n{talker}\n", "answers": "%%file answers.yaml\nanswer: 42", "why": "So."}
    return toy.hand_in(root / "class", student, load_lab(root, toy.LAB).clean_notebook(sources)["cells"])


def test_check_passes_with_status_0(root: Path) -> None:
    status, out, _ = run(root, "check", "--course", ".", "class/ann/toy.ipynb")
    assert status == 0 and "toy: 5 of 5 points" in out
    assert "The answers in words, which a person grades, give up to 4 more." in out


def test_cells_that_look_around_are_no_part_of_the_check(root: Path, tmp_path: Path) -> None:
    notebook = json.loads((root / "class" / "ann" / "toy.ipynb").read_text(encoding="utf-8"))
    looks = 'robot = launch("nonsense").start()\n%ros2 topic echo /nonsense\nrobot.stop()'
    notebook["cells"].insert(1, {"cell_type": "code", "source": looks, "metadata": {}, "outputs": []})
    notebook["cells"][1]["execution_count"] = None
    (tmp_path / "toy.ipynb").write_text(json.dumps(notebook), encoding="utf-8")
    status, out, _ = run(root, "check", "--course", ".", str(tmp_path / "toy.ipynb"))
    assert status == 0 and "toy: 5 of 5 points" in out


def test_check_fails_with_status_1_and_the_reason(root: Path) -> None:
    junit = root / "build" / "junit.xml"
    status, out, _ = run(root, "check", "--course", ".", "class/bob/toy.ipynb", "--json", "--junit", str(junit))
    assert status == 1
    result = json.loads(out)
    assert [check["points"] for check in result["checks"]] == [0, 2]
    assert "secret" not in out and "ZeroDivisionError" in out
    assert JUnitXml.fromfile(str(junit)).failures == 1


def test_check_finds_the_lab_of_a_renamed_notebook(root: Path) -> None:
    renamed = root / "class" / "ann" / "my copy (1).ipynb"
    renamed.write_bytes((root / "class" / "ann" / "toy.ipynb").read_bytes())
    status, out, _ = run(root, "check", "--course", ".", str(renamed))
    renamed.unlink()
    assert status == 0 and "5 of 5" in out


def test_what_lies_around_a_notebook_is_never_the_course(root: Path, tmp_path: Path) -> None:
    evil = toy.make_course(tmp_path / "evil")
    shutil.copytree(evil / "solutions", evil / "labs", dirs_exist_ok=True)
    (evil / "toy.ipynb").write_bytes((root / "class" / "ann" / "toy.ipynb").read_bytes())
    for folder in (evil, evil / "labs"):
        status, _, err = run(folder, "check", str(evil / "toy.ipynb"))
        assert status == 2 and "does not belong to a lab of this course" in err and f"Labs in {ROOT}: lab" in err
    status, _, err = run(evil, "grade", "toy", ".")
    assert status == 2 and "is inside the submissions" in err


def test_check_follows_no_link_out_of_a_submission(root: Path, tmp_path: Path) -> None:
    (tmp_path / "eve").mkdir()
    (tmp_path / "eve" / "toy").symlink_to(root / "class" / "ann")
    (tmp_path / "mal").symlink_to(root / "class" / "ann")
    for notebook, link in (("eve/toy/toy.ipynb", "'toy'"), ("mal/toy.ipynb", "'mal'")):
        for path in (notebook, str(tmp_path / notebook)):
            status, out, _ = run(tmp_path, "check", "--course", str(root), path)
            assert status == 1 and f"{link} is a link" in out and "0 of 5" in out


def test_who_checks_the_courses_own_copy_is_told(root: Path, tmp_path: Path) -> None:
    course = tmp_path / "course"
    shutil.copytree(root / "solutions", course / "labs")
    status, _, err = run(course, "check", "--course", ".", "labs/toy/toy.ipynb", "--isolation", "none")
    assert "the course's own copy" in err and status in (0, 1)


def test_a_broken_notebook_fails_its_checks(root: Path) -> None:
    status, out, _ = run(root, "check", "--course", ".", "class/dan/toy.ipynb")
    assert status == 1 and "not valid JSON" in out


@pytest.mark.parametrize(
    "arguments",
    [
        ["check", "nowhere.ipynb"],
        ["check", "class/ann/toy.ipynb", "--lab", "nowhere"],
        ["check", "class/ann/toy.ipynb"],
        ["check", "class/ann/toy.ipynb", "--course", "class"],
        ["grade", "nowhere", "class"],
        ["grade", "toy", "nowhere"],
        ["grade", "toy"],
        ["grade", "toy", "class", "--isolation", "some"],
        ["release", "nowhere"],
        ["report", "--what"],
        ["what"],
    ],
)
def test_usage_errors_are_sentences_with_status_2(root: Path, arguments: list[str]) -> None:
    status, _, err = run(root, *arguments)
    assert status == 2 and err.strip()


def test_what_the_machine_refuses_is_named_with_a_way_out(root: Path, tmp_path: Path) -> None:
    status, _, err = run(root, "check", "--course", ".", "class/dan/toy.ipynb", "--junit", "/proc/nowhere/j.xml")
    assert status == 2 and "/proc/nowhere/j.xml: No such file" in err and "disk has space" in err
    course = toy.make_course(tmp_path / "course")
    (course / "build").touch()
    status, _, err = run(course, "grade", "toy", str(root / "class"))
    assert status == 2 and f"{course}/build: " in err and "chown" in err and "defect" not in err


def test_a_full_disk_names_the_file_and_leaves_nothing_behind(tmp_path: Path) -> None:
    path = tmp_path / "grades.csv"
    path.write_text("whole")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))  # writing ends in the middle, as on a full disk
    try:
        with pytest.raises(OSError) as refused:
            write_beside(path, "x" * 100_000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert refused.value.filename == str(path)
    assert {file.name: file.read_text() for file in tmp_path.iterdir()} == {"grades.csv": "whole"}
    for name in (".grades.csv.999999999", f".grades.csv.{os.getpid()}", ".hidden"):  # one that was killed, one at work
        (tmp_path / name).touch()
    remove_unfinished(tmp_path)
    assert {file.name for file in tmp_path.iterdir()} == {"grades.csv", f".grades.csv.{os.getpid()}", ".hidden"}


def test_help_on_each_command(root: Path) -> None:
    for command in ("doctor", "release", "check", "grade", "report", "export"):
        status, out, _ = run(root, command, "--help")
        assert status == 0 and "--help" in out


def test_a_class_is_graded_once_and_only_what_changed_again(root: Path) -> None:
    status, out, err = run(root, "grade", "toy", "class")
    assert status == 3, err
    assert out.startswith("4 files of 4 students. All are used.") and "\n4 submissions in " in out
    rows = {line.split()[0]: line for line in out.splitlines() if line[:4] in ("ann ", "bob ", "cem ", "dan ")}
    assert "5/5" in rows["ann"] and "✓ passed" in rows["ann"]
    assert "2/5" in rows["bob"] and "1 to grade" in rows["bob"] and "ZeroDiv" in rows["bob"]
    assert "2/5" in rows["cem"] and "✗" not in rows["dan"]
    assert (
        "dan: The file is not a notebook: it is not valid JSON. There are no points yet, because a person decides."
        in out
    )
    with (root / "build" / "grades.csv").open() as file:
        scores = {row["student"]: (row["score"], row["waiting"]) for row in csv.DictReader(file)}
    assert scores == {"ann": ("5", "1"), "bob": ("2", "1"), "cem": ("2", "1"), "dan": ("", "2")}
    for student in scores:
        assert (root / "build" / "feedback" / student / "toy" / "toy.html").is_file()

    stamps = {path: path.stat().st_mtime_ns for path in (root / "build" / "results" / "toy").iterdir()}
    hand_in(root, "bob", "print('hello')")
    table = (root / "build" / "grades.csv").read_text()
    status, out, _ = run(root, "grade", "toy", "class", "--diff")
    assert status == 3 and "0/3 → 3/3" in out and "1 of 4 students would have more points, 0 fewer, 3 as many" in out
    assert {path: path.stat().st_mtime_ns for path in stamps} == stamps
    assert (root / "build" / "grades.csv").read_text() == table
    status, out, _ = run(root, "grade", "toy", "class", "--json")
    assert status == 3
    given = {result["student"]: [check["points"] for check in result["checks"]] for result in json.loads(out)}
    assert given == {"ann": [3, 2], "bob": [3, 2], "cem": [0, 2], "dan": [None, None]}
    changed = {path.stem for path, stamp in stamps.items() if path.stat().st_mtime_ns != stamp}
    assert changed == {"bob"}

    status, out, _ = run(root, "report")
    page = Path(out.strip()).read_text()
    assert status == 0 and "3 of 4" in page and "2 of 4" in page and "bob" in page
    assert run(root, "export", "csv")[1].count("\n") == 13
    status, out, _ = run(root, "export", "junit", "-o", str(root / "build" / "all.xml"))
    assert JUnitXml.fromfile(str(root / "build" / "all.xml")).tests == 13
    status, out, _ = run(root, "similar", "toy")
    assert status == 0 and "4 submissions were compared" in out
    zipped = root / "build" / "gradescope.zip"
    assert run(root, "export", "gradescope", "-o", str(zipped))[0] == 0
    assert len(zipfile.ZipFile(zipped).namelist()) == 4


def test_a_disk_without_room_is_told_with_the_file_that_it_lacks_room_for() -> None:
    with pytest.raises(OSError, match=r".") as refused, only_one(Path("/dev/full"), "A grading"):
        pass
    assert refused.value.filename == "/dev/full"


def test_two_gradings_in_one_folder_are_one_too_many(root: Path, tmp_path: Path) -> None:
    course = toy.make_course(tmp_path / "course")
    with only_one(CoursePaths(course).lock, "A grading"):
        status, _, err = run(course, "grade", "toy", str(root / "class"))
    assert status == 2 and f"A grading is at work in {course} already: process {os.getpid()}, since" in err
    assert not (course / "gradebook").exists()


def family_with_a_worker(process: subprocess.Popen[str]) -> list[psutil.Process]:
    """Wait until a submission is being run, and return every process below this one."""
    deadline = time.monotonic() + 600
    while time.monotonic() < deadline and process.poll() is None:
        with contextlib.suppress(psutil.NoSuchProcess):
            family = psutil.Process(process.pid).children(recursive=True)
            if any(member.name() == "worker" or "autograder.grading.worker" in member.cmdline() for member in family):
                return family
        time.sleep(0.05)
    pytest.fail("no submission is being run")


def test_an_interrupt_keeps_finished_results_and_leaves_nothing_running(root: Path, tmp_path: Path) -> None:
    course = toy.make_course(tmp_path / "course")
    hand_in(course, "ann", "print('hello')")
    for number in range(3):
        hand_in(course, f"stuck{number}", STUCK)
    process = start(course, "grade", "toy", "class", "--jobs", "1", start_new_session=True)
    assert process.stderr is not None
    assert "ann" in process.stderr.readline()
    family = family_with_a_worker(process)
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=600)
    assert process.returncode == 130 and "1 of 4 results are kept" in err and "Traceback" not in err
    # It does not count yet: of the known answers among the class only one has run.
    assert [path.name for path in (course / "build" / "tried" / "toy").iterdir()] == ["ann.json"]
    assert not (course / "build" / "results").exists()
    _, alive = psutil.wait_procs(family, timeout=600)
    assert alive == []


def test_killing_what_grades_costs_one_more_run_and_hangs_nothing(root: Path, tmp_path: Path) -> None:
    course = toy.make_course(tmp_path / "course")
    for number in range(2):
        hand_in(course, f"student{number}", STUCK)  # a short one could be over before this test looks
    process = start(course, "grade", "toy", "class", start_new_session=True)
    for member in family_with_a_worker(process):
        with contextlib.suppress(psutil.NoSuchProcess):
            member.kill()
    out, err = process.communicate(timeout=600)
    assert process.returncode == 0 and "Traceback" not in err, err
    assert len(list((course / "build" / "results" / "toy").iterdir())) == 2, out


@pytest.mark.parametrize("isolation", ["full", "none"])
def test_a_killed_command_leaves_nothing(
    root: Path, tmp_path: Path, isolation: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if isolation == "full" and not preflight().full:
        pytest.skip(preflight().why_not_full)
    course, scratch = toy.make_course(tmp_path / "course"), tmp_path / "tmp"
    scratch.mkdir()
    for number in range(3):
        hand_in(course, f"stuck{number}", STUCK)
    shared = in_shared_memory()
    monkeypatch.setenv("TMPDIR", str(scratch))
    monkeypatch.setattr(tempfile, "tempdir", str(scratch))
    process = start(course, "grade", "toy", "class", "--isolation", isolation, start_new_session=True)
    family = family_with_a_worker(process)
    process.kill()
    process.communicate()
    _, alive = psutil.wait_procs(family, timeout=600)
    assert alive == []
    Scratch().remove()  # as the next start does
    left = [path.name for path in scratch.iterdir() if not path.name.startswith("autograder-log-")]
    assert left == []
    deadline = time.monotonic() + 600
    while left := in_shared_memory() - shared:  # what other tests have there goes with them
        assert time.monotonic() < deadline, left
        time.sleep(0.05)


def test_an_interrupted_check_says_so(root: Path, tmp_path: Path) -> None:
    course = toy.make_course(tmp_path / "course")
    stuck = hand_in(course, "stuck", STUCK)
    process = start(course, "check", "--course", ".", str(stuck), start_new_session=True)
    family = family_with_a_worker(process)
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=600)
    assert process.returncode == 130 and err == "\nInterrupted.\n"
    _, alive = psutil.wait_procs(family, timeout=600)
    assert alive == []


def test_json_tells_what_was_left_out_and_fails_like_the_table(tmp_path: Path) -> None:
    course = toy.make_course(tmp_path / "course")
    for student in ("ann", "bob"):
        toy.hand_in(course / "class", student, "{")
    (course / "class" / "eve").symlink_to(course / "class" / "ann")
    (course / "build" / "autograded").mkdir(parents=True)
    (course / "build" / "autograded" / "bob").touch()  # nbgrader needs a folder there
    for arguments in (("--json",), ()):
        status, out, err = run(course, "grade", "toy", "class", *arguments)
        told = err if arguments else out
        assert status == 2 and "bob is not in the gradebook" in told and "eve is a link" in told
        if arguments:
            assert {result["student"] for result in json.loads(out)} == {"ann", "bob"}


def test_lint_lets_a_lab_with_warnings_pass_and_one_with_an_error_fail(tmp_path: Path) -> None:
    root = toy.make_course(tmp_path / "course")
    status, out, _ = run(root, "lint", "--static")
    assert (status, out.splitlines()[-1]) == (0, "toy: fine") and "toy: warning: " in out
    notebook = root / "solutions" / toy.LAB / f"{toy.LAB}.ipynb"
    notebook.write_text(notebook.read_text().replace("ros.score(3)", "ros.score(3", 1))
    status, out, _ = run(root, "lint", "--static")
    assert (status, out.splitlines()[-1]) == (1, "toy: 1 error") and "toy: error: " in out


def test_release_writes_what_students_receive(root: Path) -> None:
    status, out, _ = run(root, "release")
    assert status == 0 and "toy" in out
    text = (root / "labs" / "toy" / "toy.ipynb").read_text()
    assert "YOUR CODE HERE" in text and "secret" not in text and "hello" not in text
    status, out, _ = run(root, "check", "--course", ".", "labs/toy/toy.ipynb")
    assert status == 1 and "0 of 5" in out  # though a program of comments ends as the check wants it


def test_check_tells_github_what_is_wrong_and_where(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = tmp_path / "summary.md"
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(place))
    hand_in(root, "gil", "1 / 0")
    status, out, _ = run(root, "check", "class/gil/toy.ipynb", "--course", ".", "--github")
    assert status == 1
    line = next(line for line in out.splitlines() if line.startswith("::error "))
    assert "file=class/gil/toy.ipynb" in line and "hidden check failed" in line.rpartition("::")[2]
    told = place.read_text(encoding="utf-8")
    assert told.startswith("## toy: 2 of 5 points") and "| ✗ | The talker | 0 of 3 points |" in told
    status, out, err = run(root, "check", "class/gil/toy.ipynb", "--course", ".", "--github", "--json")
    assert status == 1 and json.loads(out)["lab"] == "toy" and line in err.splitlines()


def test_what_a_program_prints_is_no_command_and_no_markdown_for_github() -> None:
    bad = Outcome(status=Status.FAILED, title="a | b, c: d", because="<img src=x>\n::stop-commands::x\n[l](u) 100%")
    check = CheckResult(max_points=1, points=0, outcomes=[bad], grade_id="check", title="*The* check")
    what = {"digest": "0", "isolation": Isolation.NONE, "seed": 1, "lab": "toy", "student": "ann"}
    result = SubmissionResult(checks=[check], problems=[], **what)
    told = commands(result, Path("a,b.ipynb"))
    assert told.count("\n") == 1 and "file=a%2Cb.ipynb" in told and "\n::stop" not in told
    text = summary(result)
    assert "<img" not in text and "\\[l\\]" in text and "a \\| b" in text


def test_check_prints_a_verdict_while_later_checks_still_run(tmp_path: Path) -> None:
    course, go_on = tmp_path / "course", tmp_path / "go on"
    cells = [toy.CELLS[number] for number in (0, 1, 6, 7, 8, 3, 4, 5)]  # the table before the talker
    talker = f"%%node talker\nimport os, time\nwhile not os.path.exists({str(go_on)!r}):\n    time.sleep(0.05)\n"
    toy.hand_in(course / "solutions", toy.LAB, cells)
    answered = [cell if cell is not toy.CELLS[4] else {**cell, "source": talker} for cell in cells]
    handed_in = toy.hand_in(tmp_path / "class", "ann", answered)
    process = start(course, "check", str(handed_in), "--course", ".", "--isolation", "none")
    assert process.stdout is not None
    try:
        first = process.stdout.readline()  # it would never come if it waited for the talker
        go_on.touch()
        rest, _ = process.communicate(timeout=600)
    finally:
        process.kill()
    assert "passed  The table" in first and "The talker" in rest and "toy: 5 of 5 points" in rest


def test_check_goes_on_when_the_notebook_is_saved(root: Path, tmp_path: Path) -> None:
    notebook = tmp_path / "toy.ipynb"
    wrong, right = (hand_in(root, who, text) for who, text in (("gil", "1 / 0"), ("hal", "print('hello')")))
    notebook.write_text(wrong.read_text())
    process = start(root, "check", str(notebook), "--course", ".", "--watch")
    assert process.stderr is not None
    try:
        for _ in range(2):
            while "to be saved" not in (line := process.stderr.readline()):
                assert line, "it ended"
            with atomic_writing(str(notebook)) as file:  # as JupyterLab saves it
                file.write(right.read_text())
    finally:
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=600)
    assert out.index("toy: 2 of 5 points") < out.index("toy: 5 of 5 points")


def test_a_notebook_is_checked_and_handed_in_while_jupyterlab_saves_it(root: Path, tmp_path: Path) -> None:
    notebook, packed = tmp_path / "toy.ipynb", tmp_path / "handed in" / "toy.ipynb"
    notebook.write_text(text := hand_in(root, "ida", "print('hello')").read_text())
    with atomic_writing(str(notebook)) as file:
        file.write("{")  # a part of the new text
        file.flush()
        status, out, _ = run(root, "check", str(notebook), "--course", ".")
        assert (status, "toy: 5 of 5 points" in out) == (0, True), out
        renamed = notebook.rename(tmp_path / "mine.ipynb")
        notebook.with_name(".~toy.ipynb").rename(tmp_path / ".~mine.ipynb")
        status, out, _ = run(root, "submit", str(renamed), "--course", ".", "--output", str(packed.parent))
        assert (status, "5 of 5" in out, "JSON" in out) == (0, True, False), out
        assert packed.read_text() == text
        (tmp_path / ".~mine.ipynb").rename(notebook.with_name(".~toy.ipynb"))
        renamed.rename(notebook)
        file.write(text[1:])
    assert notebook.read_text() == text and not notebook.with_name(".~toy.ipynb").exists()
