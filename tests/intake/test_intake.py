"""What comes in from students, tried with attacks: each file in `attacks/intake` says what is tried and must hold."""

from __future__ import annotations

import contextlib
import copy
import io
import json
import os
import re
import socket
import stat
import zipfile
from pathlib import Path
from typing import Any

import pytest
import toy
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from places import TESTS

from autograder.checks import current
from autograder.checks.answers import NAME_OR_NONE
from autograder.checks.command_line import command_line
from autograder.core.errors import KitError
from autograder.core.results import Isolation, Status
from autograder.course.cells import grade_id_of
from autograder.course.lab import load_lab
from autograder.grading.job import Cell, Job
from autograder.grading.worker import run_job
from autograder.intake.collect import collect
from autograder.intake.options import Accepted
from autograder.launch_files import read_launch_file
from autograder.reasons import Refused
from autograder.report.terminal import plain
from autograder.submission.reader import read_submission

CASES = {path.stem: yaml.safe_load(path.read_text(encoding="utf-8")) for path in
         sorted((TESTS / "attacks" / "intake").glob("*.yaml"))}  # fmt: skip


KINDS = ("folder", "zip", "notebook", "table", "launch", "markup")


def of_kind(kind: str) -> Any:
    names = [name for name, case in CASES.items() if case["kind"] == kind]
    return pytest.mark.parametrize("case", [CASES[name] for name in names], ids=names)


def written_out(text: Any) -> str:
    """A text, or its parts, some of them repeated."""
    parts = [text] if isinstance(text, str) else text
    return "".join(part if isinstance(part, str) else part["of"] * part["times"] for part in parts)


def test_every_attack_says_what_is_tried_and_what_must_hold() -> None:
    assert len(CASES) >= 60
    for name, case in CASES.items():
        assert {"kind", "tried", "must"} <= case.keys(), name
        assert case["kind"] in KINDS and name.startswith(case["kind"])


def hold(case: dict[str, Any], source: Path, course: Path) -> None:
    """Take a class in; what was taken and said must be as the case wants it, and nothing lies anywhere else."""
    before = {path for path in course.parent.rglob("*") if not path.is_relative_to(course / "build")}
    collected = collect(source, toy.LAB, course, accepted=case.get("accepted", ()))
    taken = {student: path.read_text(encoding="utf-8") for student, path in collected.notebooks.items()}
    others = [text for student, text in sorted(taken.items()) if student not in case["taken"]]
    assert {student: text for student, text in taken.items() if student in case["taken"]} == case["taken"]
    if "most" in case:
        assert max(map(len, others)) <= case["most"]
    else:
        assert others == case.get("others", [])
    told = "\n".join([*collected.refused, *collected.notes])
    for words in case["said"]:
        assert words in told
    assert bool(told) == bool(case["said"]) and len(told) < 3000 and plain(told) == told
    after = {path for path in course.parent.rglob("*") if not path.is_relative_to(course / "build")}
    assert after == before


@of_kind("folder")
def test_a_folder_of_submissions(case: dict[str, Any], tmp_path: Path) -> None:
    course = toy.make_course(tmp_path / "course")
    source = tmp_path / "class"

    def place(name: str) -> Path:
        path = source / name
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    for name, text in case.get("files", {}).items():
        place(name).write_text(text)
    for name, target in case.get("links", {}).items():
        place(name).symlink_to(target.replace("/COURSE", str(course)))
    for name in case.get("fifos", []):
        os.mkfifo(place(name))
    for name in case.get("sockets", []):
        bind(place(name))
    for name in case.get("devices", []):
        try:
            os.mknod(place(name), stat.S_IFCHR | 0o666, os.makedev(1, 5))
        except PermissionError:
            pytest.skip("only root can make a device")
    hold(case, source, course)


def bind(path: Path) -> None:
    here = Path.cwd()
    os.chdir(path.parent)  # the address of a socket may only be short
    try:
        with socket.socket(socket.AF_UNIX) as bound:
            bound.bind(path.name)
    finally:
        os.chdir(here)


@of_kind("zip")
def test_a_zip_of_submissions(case: dict[str, Any], tmp_path: Path) -> None:
    source = tmp_path / "class.zip"
    unmarked = raw = b""
    with zipfile.ZipFile(source, "w", zipfile.ZIP_DEFLATED) as archive:
        for member in case["members"]:
            for _ in range(member.get("times", 1)):
                info = zipfile.ZipInfo(written_out(member["name"]))
                info.external_attr = member.get("mode", 0) << 16
                with pytest.MonkeyPatch.context() as patch:
                    patch.setattr("warnings.warn", lambda *_, **__: None)  # a name that is there already
                    archive.writestr(info, written_out(member["content"]), zipfile.ZIP_DEFLATED)
            unmarked = info.filename.encode() if member.get("unmarked") else unmarked
            raw = member.get("raw_name", "").encode() or raw
    content = source.read_bytes()
    if raw:  # zipfile does not write what it has to read here
        content = content.replace(b"eve/toy.ipynb", raw)
    if unmarked:
        content = without_mark(content, unmarked)
    source.write_bytes(content)
    hold(case, source, toy.make_course(tmp_path / "course"))


def without_mark(content: bytes, name: bytes) -> bytes:
    """Take away the mark that a name is in UTF-8, in the member's own header and in the directory's."""
    made = bytearray(content)
    for signature, flags, start in ((b"PK\x03\x04", 6, 30), (b"PK\x01\x02", 8, 46)):
        at = content.index(signature)
        while content[at + start : at + start + len(name)] != name:
            at = content.index(signature, at + 1)
        made[at + flags + 1] &= ~0x08
    return bytes(made)


@of_kind("notebook")
def test_a_notebook(case: dict[str, Any], tmp_path: Path) -> None:
    lab = load_lab(toy.make_course(tmp_path / "course"), toy.LAB)
    if "content" in case:
        content: Any = written_out(case["content"])
    else:
        answers = {answer.grade_id: answer.solution for answer in lab.answers.values()}
        content = lab.clean_notebook(answers)["cells"]
        for grade_id, change in copy.deepcopy(case["cells"]).items():
            if "source" in change:
                change["source"] = written_out(change["source"])
            next(cell for cell in content if grade_id_of(cell) == grade_id).update(change)
    submission = read_submission(toy.hand_in(tmp_path / "class", "ann", content), lab)
    assert [problem.code for problem in submission.problems] == case["codes"]
    assert submission.readable == ("content" not in case)
    assert submission.files["helper.py"].endswith("\nprint('given')\n")
    json.dumps(lab.clean_notebook(submission.sources), allow_nan=False)


def test_tables_of_answers(tmp_path: Path) -> None:
    """All in one run of the worker, one check each."""
    cases = {name: case for name, case in CASES.items() if case["kind"] == "table"}
    check = 'with answers("{0}.yaml") as table:\n    table.expect_answer("answer", 42)\ntable.score(2)'
    job = Job(
        student="ann", lab=toy.LAB, digest="", isolation=Isolation.NONE, seed=1,
        files={f"{name}.yaml": written_out(case["text"]) for name, case in cases.items()},
        cells=[
            Cell(grade_id="setup", source="from autograder.checks import answers"),
            *(Cell(grade_id=name, points=2, source=check.format(name)) for name in cases),
        ],
    )  # fmt: skip
    results = {check.grade_id: check for check in run_job(job, tmp_path)}
    assert results.keys() == cases.keys()
    for name, case in cases.items():
        assert (results[name].status, results[name].points) == (Status.FAILED, 0.0), name
        failure = results[name].first_failure
        assert failure is not None and len(failure.because) < 400
        for words in (f"line {case['line']} of the cell" if "line" in case else "", *case["said"]):
            assert words in failure.because, name


@of_kind("launch")
def test_a_launch_file(case: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "attack.launch.yaml"
    path.write_text(written_out(case["text"]), encoding="utf-8")
    with pytest.raises(Refused) as refused:
        read_launch_file(path, {})
    told = str(refused.value)
    assert len(told) < 600 and "root:" not in told
    for words in case["said"]:
        assert words in told


@of_kind("markup")
def test_markdown(case: dict[str, Any]) -> None:
    from bs4 import BeautifulSoup
    from nbconvert.filters import markdown2html

    from autograder.gradebook.autograde import harmless

    page = BeautifulSoup(markdown2html(harmless(written_out(case["text"]))), "html.parser")
    plain = {"p", "a", "code", "pre", "br", "em", "strong", "blockquote", "ol", "li"}
    assert {tag.name for tag in page.find_all()} <= plain
    for link in page.find_all("a"):
        # Whatever is left as a link plainly leads to a web page, and somebody has to click on it.
        assert link.attrs.keys() <= {"href", "class"} and str(link.get("href", "#"))[:4] in ("http", "#"), link
    assert page.get_text().strip() and " " * 1000 not in page.get_text()
    assert len(re.findall(r"\\begin\{|\\\\[\[(]", page.get_text())) <= 100


values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8) | st.dates(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3) | st.integers(), inner, max_size=3),
    max_leaves=6,
)
tables = st.dictionaries(st.sampled_from(["number", "word", "name", "words", 7]), values, max_size=5).map(
    lambda table: yaml.safe_dump(table, allow_unicode=True)
)
# A cell of its own, as in a lab: below a function, the kit would look for the check in every file that called it.
CHECK = compile(
    """
from autograder.checks import answers
with answers("table.yaml") as table:
    table.expect_filled(FORMS)
    table.expect_answer("number", 4)
    table.expect_answer("word", "yes")
    table.expect_answer("name", "/a/b")
    table.expect_answer("words", ["a", "b"])
scores.append(table.score(2))
""",
    "<check>",
    "exec",
)
FORMS = {"number": range(1, 9), "word": ["yes", "no"], "name": NAME_OR_NONE, "words": [["a", "b"], ["b", "a"]]}


@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(text=tables | st.text(max_size=40).map(lambda text: f"number: {text}\nword: {text}"))
def test_no_table_leaves_a_check_undecided(text: str, tmp_path: Path) -> None:
    before = current.check.folder
    current.check.configure(tmp_path, Isolation.NONE, seed=1)
    (tmp_path / "table.yaml").write_bytes(text.encode("utf-8", "replace"))
    current.check.findings.reset()
    try:
        exec(CHECK, globals() | {"scores": (scores := [])})
        result = scores[0].result
        assert result.status in (Status.FAILED, Status.PASSED), result.outcomes
        with contextlib.suppress(Refused):
            command_line("table.yaml", "word").words()
    finally:
        current.check.configure(before, Isolation.NONE, seed=1)
        current.check.findings.reset()


WHOLE = io.BytesIO()
with zipfile.ZipFile(WHOLE, "w", zipfile.ZIP_DEFLATED) as whole:
    for who in ("ann", "José", "cem/toy"):
        whole.writestr(f"{who}/toy.ipynb", f"the work of {who}")


def taken_from(content: bytes, tmp_path: Path) -> dict[str, Path]:
    """Take a zip in that may be anything; nothing but a sentence may come of it."""
    (tmp_path / "class.zip").write_bytes(content)
    try:
        collected = collect(tmp_path / "class.zip", toy.LAB, tmp_path / "course", accepted=tuple(Accepted))
    except KitError:
        return {}
    for student, path in collected.notebooks.items():
        assert path.parent.parent.parent == tmp_path / "course" / "build" / "submitted" and path.is_file()
        assert plain(student) == student
    return collected.notebooks


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(
    changes=st.lists(st.tuples(st.integers(0, len(WHOLE.getvalue()) - 1), st.integers(0, 255)), min_size=1, max_size=6)
)
def test_no_damaged_zip_stops_a_class(changes: list[tuple[int, int]], tmp_path: Path) -> None:
    content = bytearray(WHOLE.getvalue())
    for at, value in changes:
        content[at] = value
    taken_from(bytes(content), tmp_path)


@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(names=st.lists(st.text(min_size=1, max_size=90).filter(lambda name: "\0" not in name), max_size=4, unique=True))
def test_no_name_in_a_zip_stops_a_class(names: list[str], tmp_path: Path) -> None:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        archive.writestr("bob/toy.ipynb", "bob's work")
        for name in names:
            with contextlib.suppress(UnicodeEncodeError):  # half characters, which a zip cannot hold
                archive.writestr(zipfile.ZipInfo(f"{name}/toy.ipynb"), name.encode("utf-8", "replace"))
    taken = taken_from(content.getvalue(), tmp_path)
    if not any(name.startswith("bob") for name in names):
        assert taken["bob"].read_text() == "bob's work"


@pytest.mark.parametrize("zipped", [False, True])
def test_zips_in_zips_may_only_take_so_much_together(zipped: bool, tmp_path: Path) -> None:
    """Each level multiplies what the one before holds: to list a few megabytes took days."""
    folders, several = io.BytesIO(), io.BytesIO()
    with zipfile.ZipFile(folders, "w") as archive:
        for number in range(30_000):
            archive.writestr(zipfile.ZipInfo(f"{number}/"), "")
    with zipfile.ZipFile(several, "w", zipfile.ZIP_DEFLATED) as archive:
        for number in range(4):
            archive.writestr(f"{number}.zip", folders.getvalue())
        archive.writestr("toy.ipynb", "the work of eve")
    files = {"ann/toy.ipynb": b"the work of ann", "eve/all.zip": several.getvalue()}
    source = tmp_path / "class"
    for name, content in files.items():
        (source / name).parent.mkdir(parents=True)
        (source / name).write_bytes(content)
    if zipped:
        with zipfile.ZipFile(source.with_suffix(".zip"), "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in files.items():
                archive.writestr(name, content)
        source = source.with_suffix(".zip")
    collected = collect(source, toy.LAB, tmp_path / "course", accepted=tuple(Accepted))
    assert list(collected.notebooks) == ["ann"]
    assert "the zips in it have more than 256 MiB, or more than 100000 files and folders" in str(collected.refused)


@pytest.mark.parametrize("zipped", [False, True])
def test_when_it_was_handed_in_is_taken_if_it_is_a_time(tmp_path: Path, zipped: bool) -> None:
    course = toy.make_course(tmp_path / "course")
    said = {
        "ann": "2026-11-02 14:30:00.123456 UTC\n",
        "bob": "{{ evil }}",
        "cem": "2026-11-02 14:30" + " " * 9000 + "x",
    }
    for student, text in said.items():
        toy.hand_in(tmp_path / "class", student, "{").with_name("timestamp.txt").write_text(text, encoding="utf-8")
    source = tmp_path / "class"
    if zipped:
        source = tmp_path / "class.zip"
        with zipfile.ZipFile(source, "w") as archive:
            for path in (tmp_path / "class").rglob("*.*"):
                archive.write(path, path.relative_to(tmp_path))
    collected = collect(source, toy.LAB, course)
    stamps = {who: path.with_name("timestamp.txt") for who, path in collected.notebooks.items()}
    assert stamps["ann"].read_text(encoding="utf-8") == "2026-11-02 14:30:00.123456 UTC"
    assert not stamps["bob"].exists() and collected.refused[0].startswith("timestamp.txt of bob is not a date and time")
    (tmp_path / "class" / "ann" / "timestamp.txt").unlink()
    collect(tmp_path / "class", toy.LAB, course)
    assert not stamps["ann"].exists()
