"""Makes the pictures of README.md and of the book's pages about labs and grading again, each from a real run.

`python tests/tools/readme_pictures.py` takes about two minutes.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

import sample_class
from jupyter_lab import jupyter_lab, run_all
from PIL import Image
from places import ROOT
from playwright.sync_api import sync_playwright
from rich.console import Console
from rich.terminal_theme import DEFAULT_TERMINAL_THEME
from rich.text import Text

from autograder.course.cells import grade_id_of
from autograder.course.lab import Lab, load_lab

PICTURES = ROOT / "lectures" / "_static"
LAB, STUDENT = "lab2_executors", "e03_no_groups"
CLASS = ["correct_groups", STUDENT, "m01_one_mistake_a_part", "partial", "solution", "syntax_error"]
COLUMNS = 110
COLOURS = 64
"""So many are enough for text, and take a third of the bytes."""

SVG = """<svg viewBox="0 0 {width} {height}" xmlns="http://www.w3.org/2000/svg"><style>
.{unique_id}-matrix {{ font-family: monospace; font-size: {char_height}px; line-height: {line_height}px; }}
.{unique_id}-title {{ font-size: 18px; font-family: sans-serif; }}
{styles}</style><defs><clipPath id="{unique_id}-clip-terminal"><rect x="0" y="0" width="{terminal_width}"
height="{terminal_height}"/></clipPath>{lines}</defs>{chrome}<g transform="translate({terminal_x}, {terminal_y})"
clip-path="url(#{unique_id}-clip-terminal)">{backgrounds}<g class="{unique_id}-matrix">{matrix}</g></g></svg>"""
"""rich's own picture of a terminal asks a server for its font; this one takes what the reader has."""


def grade(lab: Lab, folder: Path) -> tuple[Path, str]:
    """Grade a small class, and return the course's folder and what the terminal shows."""
    course = folder / "course"
    shutil.copytree(ROOT / "solutions" / LAB, course / "solutions" / LAB)
    for student in CLASS:
        sample_class.build_student(lab, student, folder / "class")
    program = Path(sys.executable).with_name("autograder")
    environment = os.environ | {"FORCE_COLOR": "1", "COLUMNS": str(COLUMNS), "TERM": "xterm-256color"}
    done = subprocess.run(
        [program, "grade", LAB, folder / "class"], cwd=course, env=environment, capture_output=True, check=True
    )
    return course, done.stdout.decode().replace(f"{course}/", "")


def terminal(shown: str) -> None:
    """Draw a terminal with a command's output in it."""
    console = Console(record=True, width=COLUMNS, file=io.StringIO(), force_terminal=True)
    console.print(Text.from_ansi(f"$ make grade LAB={LAB} SUBMISSIONS=class\n{shown}"))
    picture = console.export_svg(title="make grade", theme=DEFAULT_TERMINAL_THEME, code_format=SVG, unique_id="grade")
    (PICTURES / "terminal.svg").write_text(picture, encoding="utf-8")


def feedback(browser: Any, course: Path) -> None:
    """Take a picture of the first check on a feedback page."""
    page = browser.new_page(viewport={"width": 900, "height": 1000}, device_scale_factor=1.5)
    page.goto((course / "build" / "feedback" / STUDENT / LAB / f"{LAB}.html").as_uri())
    report = page.locator("section [role=group]").first
    report.screenshot(path=PICTURES / "report.png")
    page.close()


def beginning(notebook: Path, check: str, into: Path) -> None:
    """Write a notebook's cells up to a check."""
    content = json.loads(notebook.read_text(encoding="utf-8"))
    last = next(number for number, cell in enumerate(content["cells"]) if grade_id_of(cell) == check)
    del content["cells"][last + 1 :]
    into.write_text(json.dumps(content), encoding="utf-8")


def notebook(browser: Any, lab: Lab, folder: Path) -> None:
    """Take a picture of a student's cell in JupyterLab and of what its check says."""
    (folder / "jupyter").mkdir()
    with jupyter_lab(folder / "jupyter") as (work, address):
        handed_in = folder / "class" / STUDENT / f"{LAB}.ipynb"
        beginning(handed_in, lab.checks[0].grade_id, work / f"{LAB}.ipynb")
        window = browser.new_context(viewport={"width": 1200, "height": 800})
        page, _ = run_all(window, address, LAB)
        page.locator(".jp-CodeCell").last.scroll_into_view_if_needed()
        page.wait_for_timeout(500)
        page.screenshot(path=PICTURES / "notebook.png")
        window.close()


def main() -> None:
    """Make all pictures."""
    lab = load_lab(ROOT, LAB)
    with tempfile.TemporaryDirectory() as name, contextlib.ExitStack() as stack:
        course, shown = grade(lab, Path(name))
        terminal(shown)
        chromium = stack.enter_context(sync_playwright()).chromium
        browser = chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        feedback(browser, course)
        notebook(browser, lab, Path(name))
        browser.close()
    for picture in ("report.png", "notebook.png"):
        Image.open(PICTURES / picture).quantize(COLOURS).save(PICTURES / picture, optimize=True)
    for picture in ("terminal.svg", "report.png", "notebook.png"):
        path = PICTURES / picture
        print(f"{path.relative_to(ROOT)}  {path.stat().st_size // 1024} KiB")


if __name__ == "__main__":
    main()
