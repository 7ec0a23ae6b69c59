"""Write the student's kit: the labs, the lectures, and the kit as a wheel without solutions or hidden tests.

The labs are only in the folder `kit`. Set-up copies them once to the folder in which a student works, so that unpacking
a new version never replaces a student's work.

Before the files are handed out, they are searched for every hidden test, solution and mark scheme in the sources of the
labs. Spaces do not count. Except for a marked solution, each single line is searched for as well. Texts shorter than 24
characters are skipped, and so are texts that students receive in the released lab anyway.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from autograder.core.errors import KitError
from autograder.course.cells import nbgrader_of, source_of
from autograder.course.lab import lab_names
from autograder.course.paths import CoursePaths
from autograder.course.settings import SETTINGS_FILE, CourseSettings, read_settings
from autograder.setup.places import KIT_FOLDER, ROOT, STUDENT_LOCK

_REGION = re.compile(r"BEGIN (HIDDEN TESTS|SOLUTION|MARK SCHEME)[^\n]*\n(.*?)^[^\n]*END \1", re.DOTALL | re.MULTILINE)
_MARK = re.compile(r"#+ (BEGIN|END) (HIDDEN TESTS|SOLUTION|MARK SCHEME)$")
_TELLING = 24
"""The minimum length, without spaces, of a text that is searched for. Shorter texts occur everywhere."""
_PACKED = (".whl", ".zip")


@dataclass(frozen=True)
class Secret:
    """A text of a lab that students must not receive."""

    lab: str
    kind: str
    text: str
    """The text without spaces and line breaks."""


def secrets_of(root: Path, labs: Sequence[str]) -> list[Secret]:
    """Return the texts of these labs that students must not receive, except those that the released lab contains."""
    paths = CoursePaths(root)
    found: dict[str, Secret] = {}
    for lab in labs:
        source = paths.solutions / lab / f"{lab}.ipynb"
        if not source.is_file():
            continue
        given = "".join(_dense(text) for text in _sources(paths.labs / lab / f"{lab}.ipynb"))
        for cell in json.loads(source.read_text(encoding="utf-8"))["cells"]:
            text = source_of(cell)
            regions = _REGION.findall(text)
            if nbgrader_of(cell).get("solution") and "BEGIN SOLUTION" not in text:  # then the whole cell is the answer
                regions.append(("answer", text))
            for kind, inner in regions:
                pieces = [inner] if kind == "SOLUTION" else [inner, *inner.split("\n")]
                for piece in map(_dense, pieces):
                    if len(piece) >= _TELLING and piece not in given:
                        found.setdefault(piece, Secret(lab, kind.lower().rstrip("s"), piece))
    return list(found.values())


def leaks(folder: Path, secrets: Sequence[Secret]) -> list[str]:
    """Return a line for each secret, or mark of a secret, in the files of a folder and of the wheels and zips in it."""
    found = []
    for name, text in _texts(folder):
        dense = _dense(text)
        found += [f"{name}: a {one.kind} of {one.lab}" for one in secrets if one.text in dense]
        if name.endswith(".ipynb") and any(
            _MARK.search(line.strip()) for line in text.replace("\\n", "\n").split("\n")
        ):
            found.append(f"{name}: the mark of a solution or a hidden test")
    return found


def _dense(text: str) -> str:
    return "".join(text.split())


def _sources(notebook: Path) -> list[str]:
    return [source_of(cell) for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]]


def _texts(folder: Path) -> Iterator[tuple[str, str]]:
    """Yield the name and text of every file, and for a notebook also the text of its cells.

    In a notebook's JSON, quotation marks are escaped. In the text of its cells, they are not.
    """
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        name = str(path.relative_to(folder))
        if path.suffix in _PACKED:
            with zipfile.ZipFile(path) as packed:
                for inner in packed.namelist():
                    yield from _as_text(f"{name}/{inner}", packed.read(inner))
        else:
            yield from _as_text(name, path.read_bytes())


def _as_text(name: str, content: bytes) -> Iterator[tuple[str, str]]:
    text = content.decode("utf-8", "replace")
    yield name, text
    if name.endswith(".ipynb"):
        yield name, "\n".join(source_of(cell) for cell in json.loads(text)["cells"])


NAME = "ros2-labs"
"""The name of the folder and of the zip."""
INSTRUCTORS = (
    "authoring",
    "gradebook",
    "own_run/keys.py",
    "report/class_page.py",
    "report/answers_page.py",
    "report/term_page.py",
    "report/viva_page.py",
    "report/templates/answers.html",
    "report/templates/class.html",
    "report/templates/instructors_page.html",
    "report/templates/term.html",
    "report/templates/viva.html",
)
"""The parts of the package `autograder` that students do not get."""
STUDENTS = {
    "cli": (
        "__init__",
        "app",
        "appeal",
        "check",
        "chosen",
        "doctor",
        "machine",
        "main",
        "package",
        "ros2",
        "submit",
        "world",
    ),
    "intake": ("__init__", "record"),
}
"""The modules that students get from each of these folders. The others are for instructors."""

_TEMPLATES = Path(__file__).with_name("templates") / "kit"
_PLACES = {
    "Makefile": "Makefile",
    "readme.template": "README.md",
    "gitignore": ".gitignore",
    "devcontainer.json": ".devcontainer/devcontainer.json",
    "workflow.yml": ".github/workflows/check.yml",
    "Dockerfile": "binder/Dockerfile",
}
"""The path of the file that is made from each template."""
_BOOK_ROW = "| `lectures` | the lectures: open `lectures/index.html` in a browser |\n"
_SLIDES = re.compile(r'\s*<a class="to-slides".*?</a>|<a [^>]*href="[./]*/slides/[^>]*>(?P<words>.*?)</a>')
"""A link from a page to slides; of one in a sentence the words stay. Slides and their notes are only for teachers."""
_TEACHERS_PAGES = "instructors"
"""The folder of a book's pages for teachers. They hold exam questions with answers."""
_TO_TEACHERS_PAGES = re.compile(rf'<a\b[^>]*href="(?:\.\./)*{_TEACHERS_PAGES}/[^"]*"[^>]*>(.*?)</a>', re.DOTALL)
_NOT_OURS = shutil.ignore_patterns(".*", "__pycache__", "*.pyc", "nodes", "*.new", "*.map", "notebooks")
"""What is not copied: what programs leave behind, and of the book what no reader of its pages needs."""
_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The time of every file in the zip. It is always the same, so that equal sources give equal zips."""


def write_kit(root: Path, book: Path | None, into: Path) -> Path:
    """Write the student's kit of the course at `root` as a folder and a zip, and return the path of the zip.

    Args:
        root: the course's folder. Its `labs` are copied as they are.
        book: a folder with the lectures as HTML, of which students get all but the pages for teachers; None if the kit
            contains no lectures.
        into: the folder in which the folder and the zip are written.

    Raises:
        KitError: there are no labs, the wheel cannot be built, or the kit would contain a solution or hidden test.
    """
    paths = CoursePaths(root)
    names = [name for name in lab_names(root) if (paths.labs / name / f"{name}.ipynb").is_file()]
    lock = ROOT / STUDENT_LOCK
    if not names:
        raise KitError(f"There are no labs in {paths.labs}.", "Make them from the solutions: autograder release")
    if not lock.is_file() or not (ROOT / "pyproject.toml").is_file():
        raise KitError("The students' kit can be built only from a checkout of the kit.", "Use a checkout.")
    folder = into / NAME
    shutil.rmtree(folder, ignore_errors=True)
    labs = folder / KIT_FOLDER / "labs"
    for name in names:
        shutil.copytree(paths.labs / name, labs / name, ignore=_NOT_OURS)
        if paths.versions(name).is_file():  # so that a student with an earlier version is not told of changed cells
            there = CoursePaths(folder / KIT_FOLDER).versions(name)
            there.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(paths.versions(name), there)
    shutil.copy(paths.labs / "README.md", labs)
    if book is not None:
        _copy_book(book, folder / "lectures")
    settings = read_settings(root)
    (folder / KIT_FOLDER / SETTINGS_FILE).write_text(_settings_file(settings, names), encoding="utf-8")
    shutil.copy(lock, folder)
    wheel = build_wheel(folder / KIT_FOLDER)
    values = {"WHEEL": wheel.name, "TITLE": settings.title, "FIRST": names[0], "NAME": NAME}
    values["BOOK"] = _BOOK_ROW if book else ""
    for template, where in _PLACES.items():
        text = (_TEMPLATES / template).read_text(encoding="utf-8")
        for word, value in values.items():
            text = text.replace(f"@{word}@", value)
        (folder / where).parent.mkdir(parents=True, exist_ok=True)
        (folder / where).write_text(text, encoding="utf-8")
    found = leaks(folder, secrets_of(root, names))
    if found:
        shutil.rmtree(folder)
        what = "The students' kit would contain something that students must not see:"
        raise KitError("\n  ".join([what, *found[:10]]), "Nothing was written.")
    return _zipped(folder)


def _copy_book(book: Path, into: Path) -> None:
    """Copy the lectures without the pages for teachers, and without links to those and to the slides."""
    shutil.copytree(book, into, ignore=_NOT_OURS)
    shutil.rmtree(into / _TEACHERS_PAGES, ignore_errors=True)
    for page in into.rglob("*.html"):
        text = _SLIDES.sub(lambda link: link["words"] or "", page.read_text(encoding="utf-8"))
        page.write_text(_TO_TEACHERS_PAGES.sub(r"\1", text), encoding="utf-8")


def _settings_file(settings: CourseSettings, names: Sequence[str]) -> str:
    """Return the students' `course.toml`: the title, these labs, and the sections that explain the reasons."""
    lines = [f"title = {_toml(settings.title)}", f"labs = {_toml(list(names))}", "", "[lectures]"]
    lines += [f"{_toml(name)} = {_toml(page)}" for name, page in settings.lectures.items()]
    for lecture, titles in settings.sections.items():
        lines += ["", f"[sections.{_toml(lecture)}]"]
        lines += [f"{_toml(title)} = {_toml(codes)}" for title, codes in titles.items()]
    return "\n".join(lines) + "\n"


def _toml(value: str | list[str]) -> str:
    """Format a text or a list of texts for TOML, which writes them as JSON does."""
    return json.dumps(value, ensure_ascii=False)


def build_wheel(into: Path) -> Path:
    """Build a wheel of the kit without the parts that only instructors use, and return the wheel's path.

    Raises:
        KitError: the wheel cannot be built.
    """
    with tempfile.TemporaryDirectory() as name:
        source = Path(name)
        for file in ("README.md", "LICENSE"):
            shutil.copy(ROOT / file, source)
        shutil.copytree(ROOT / "autograder", source / "autograder", ignore=_NOT_OURS)
        package = source / "autograder"
        dropped = [package / one for one in INSTRUCTORS]
        for folder, kept in STUDENTS.items():
            dropped += [path for path in (package / folder).glob("*.py") if path.stem not in kept]
        for path in dropped:
            shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
        # The gradebook package is only for instructors, so students get the nbgrader configuration of `grading`.
        project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
        project = project.replace('"autograder/gradebook/environment/', '"autograder/grading/environment/')
        (source / "pyproject.toml").write_text(project, encoding="utf-8")
        options = ("--quiet", "--wheel", "--no-build-isolation", "--offline", "--python", sys.executable)
        done = subprocess.run(
            [str(Path(sys.executable).with_name("uv")), "build", *options, "--out-dir", str(into), str(source)],
            env=os.environ | {"SOURCE_DATE_EPOCH": "315532800"},
            capture_output=True,
            text=True,
            check=False,
        )
    if done.returncode:
        raise KitError(f"The wheel cannot be built:\n{done.stderr.strip()[-2000:]}", "Run it with: make release")
    (into / ".gitignore").unlink(missing_ok=True)  # uv hides what it builds from git
    return next(into.glob("*.whl"))


def _zipped(folder: Path) -> Path:
    archive = folder.with_suffix(".zip")
    beside = archive.with_suffix(".new")
    with zipfile.ZipFile(beside, "w", zipfile.ZIP_DEFLATED) as packed:
        for path in sorted(path for path in folder.rglob("*") if path.is_file()):
            info = zipfile.ZipInfo(str(path.relative_to(folder.parent)), _EPOCH)
            info.external_attr = 0o100644 << 16
            info.compress_type = zipfile.ZIP_DEFLATED
            packed.writestr(info, path.read_bytes())
    beside.replace(archive)
    return archive
