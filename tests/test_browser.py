"""The labs in a real JupyterLab and a real browser: run from top to bottom, they give the verdicts of grading.

The browser is Debian's chromium. Where there is none the test is skipped, except in CI.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parent))

import sample_class
from served import address_of

from autograder.course.lab import lab_names, load_lab

ROOT = Path(__file__).resolve().parent.parent
START_SECONDS, RUN_SECONDS = 180, 600
"""Far beyond what it takes (5 s and 35 s on two cores), for a machine that does much else."""

# All cells in the page at once: JupyterLab otherwise keeps only those in view.
SETTINGS = {"@jupyterlab/notebook-extension": {"tracker": {"windowingMode": "none"}}}

# Of every code cell, in order: its source, the prompt beside it, the text of its outputs, and whether one is an error.
CELLS = """() => [...document.querySelectorAll('.jp-CodeCell')].map(cell => ({
  prompt: cell.querySelector('.jp-InputArea-prompt').textContent,
  output: [...cell.querySelectorAll('.jp-OutputArea-output')].map(output => output.innerText).join('\\n'),
  error: !!cell.querySelector('[data-mime-type="application/vnd.jupyter.error"]'),
}))"""
PROMPTS = "() => [...document.querySelectorAll('.jp-CodeCell .jp-InputArea-prompt')].map(prompt => prompt.textContent)"


@pytest.fixture(scope="module")
def jupyter(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, str]]:
    with jupyter_lab(tmp_path_factory.mktemp("jupyter")) as started:
        yield started


@contextlib.contextmanager
def jupyter_lab(tmp_path: Path) -> Iterator[tuple[Path, str]]:
    """Start JupyterLab as `make jupyter` does, untouched by this user's own settings; gives its folder and address."""
    work, home = tmp_path / "labs", tmp_path / "home"
    work.mkdir()
    shutil.copy(ROOT / "labs" / "README.md", work)
    for package, plugins in SETTINGS.items():
        for plugin, values in plugins.items():
            path = home / "settings" / package / f"{plugin}.jupyterlab-settings"
            path.parent.mkdir(parents=True)
            path.write_text(json.dumps(values))
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("JUPYTER", "ROS_"))}
    environment |= {
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "HOME": str(home),
        "JUPYTER_RUNTIME_DIR": str(home / "runtime"),
        "JUPYTERLAB_SETTINGS_DIR": str(home / "settings"),
    }
    command = [str(Path(sys.executable).with_name("autograder")), "jupyter"]
    command += ["--no-browser", "--ServerApp.port=0", "--ServerApp.ip=127.0.0.1"]
    command += [f"--ServerApp.root_dir={work}", "--IdentityProvider.token=lab"]
    with (tmp_path / "jupyter.log").open("w") as log:
        server = subprocess.Popen(command, cwd=ROOT, env=environment, stdout=log, stderr=subprocess.STDOUT)
        try:
            yield work, address_of(server, home / "runtime", tmp_path / "jupyter.log")
        finally:
            server.terminate()
            try:
                server.wait(timeout=20)
            except subprocess.TimeoutExpired:
                server.kill()
                server.wait()


@pytest.fixture(scope="module")
def window(browser: Any) -> Iterator[Any]:
    """Where pages are opened: they share what the browser has read and compiled of JupyterLab."""
    opened = browser.new_context(viewport={"width": 1400, "height": 900})
    opened.set_default_timeout(START_SECONDS * 1000)
    yield opened
    opened.close()


def kernel_is_idle(kernels: list[dict[str, Any]]) -> bool:
    """Whether the server says that the page is connected to a kernel that waits for work."""
    return any(kernel["execution_state"] == "idle" and kernel["connections"] for kernel in kernels)


def run_all(window: Any, address: str, name: str) -> tuple[Any, list[dict[str, Any]]]:
    """Open a notebook, choose Run > Run All Cells, and give the page and its code cells once the last has been run."""
    page = window.new_page()
    outside: list[str] = []
    own = (address, address.replace("http", "ws"), "data:", "blob:")
    page.on("request", lambda request: None if request.url.startswith(own) else outside.append(request.url))
    # A workspace of its own: the one of the last page would open its notebook, too.
    page.goto(f"{address}lab/workspaces/{name}/tree/{name}.ipynb?token=lab&reset", timeout=START_SECONDS * 1000)
    page.wait_for_selector(".jp-Notebook .jp-CodeCell", timeout=START_SECONDS * 1000)
    page.wait_for_selector(".jp-Notebook-ExecutionIndicator[data-status='idle']", timeout=START_SECONDS * 1000)
    deadline = time.monotonic() + RUN_SECONDS
    # What is chosen while JupyterLab still connects to the kernel is not done; a dialog says so, or nothing does.
    while all("[ ]" in prompt for prompt in page.evaluate(PROMPTS)):
        assert time.monotonic() < deadline, "Run All Cells runs no cell"
        if page.locator(".jp-Dialog").count():
            page.keyboard.press("Escape")
        elif kernel_is_idle(kernels(page, address, name)):
            page.click("text=Run >> nth=0")
            page.click("text='Run All Cells'")
        page.wait_for_timeout(2000)
    while any("*" in prompt or "[ ]" in prompt for prompt in page.evaluate(PROMPTS)):
        assert time.monotonic() < deadline, [c for c in page.evaluate(CELLS) if not re.search(r"\d", c["prompt"])]
        page.wait_for_timeout(500)
    page.wait_for_selector(".jp-Notebook-ExecutionIndicator[data-status='idle']", timeout=START_SECONDS * 1000)
    cells: list[dict[str, Any]] = page.evaluate(CELLS)
    assert not outside, f"the page asked for {outside}"
    return page, cells


def kernels(page: Any, address: str, name: str) -> list[dict[str, Any]]:
    """The kernel of a notebook, as the server describes it."""
    sessions = page.request.get(f"{address}api/sessions?token=lab").json()
    return [session["kernel"] for session in sessions if session["path"] == f"{name}.ipynb"]


def _close(page: Any, address: str, name: str) -> None:
    """Close a page and end the kernel of its notebook, which others would have to share the machine with."""
    for kernel in kernels(page, address, name):
        page.request.delete(f"{address}api/kernels/{kernel['id']}?token=lab")
    page.close()


def _picture(page: Any, name: str) -> None:
    """Keep a picture for people to look at, if one is asked for."""
    folder = os.environ.get("LAB_SCREENSHOT")
    if folder:
        page.screenshot(path=f"{folder}/{name}.png")


@pytest.mark.parametrize(
    ("lab_name", "student"),
    [
        ("lab2_executors", "e03_no_groups"),  # has passed and failed checks
        *(pytest.param(lab, "solution", marks=pytest.mark.complete) for lab in lab_names(ROOT)),
    ],
)
def test_the_lab_runs_top_to_bottom_with_the_verdicts_of_grading(
    window: Any, jupyter: tuple[Path, str], tmp_path: Path, lab_name: str, student: str
) -> None:
    work, address = jupyter
    lab = load_lab(ROOT, lab_name)
    handed_in = sample_class.build_student(lab, student, tmp_path) / f"{lab.name}.ipynb"
    name = f"{lab.name}-{student}"
    shutil.copy(handed_in, work / f"{name}.ipynb")
    expected = sample_class.expected(lab, student)
    sources = [cell for cell in json.loads(handed_in.read_text())["cells"] if cell["cell_type"] == "code"]

    page, cells = run_all(window, address, name)
    _picture(page, name)
    _close(page, address, name)

    assert len(cells) == len(sources)
    assert [cell["output"] for cell in cells if cell["error"]] == []
    shown = {}
    for source, cell in zip(sources, cells, strict=True):
        grade_id = source["metadata"].get("nbgrader", {}).get("grade_id", "")
        if grade_id in expected.points:
            shown[grade_id] = cell["output"]
    assert shown.keys() == expected.points.keys()
    # The student's copy has no hidden tests: it claims no points that these decide about.
    for check, points in expected.points.items():
        if "decided when the lab is graded" in shown[check]:
            assert re.search(r"(holds so far|partly passed)", shown[check]), shown[check]
            assert not re.search(r"(?<!up to )\d+ of \d+ points", shown[check].split("\n")[0]), shown[check]
            continue
        verdict = re.search(r"(passed|failed).*?([\d.]+) of (\d+) point", shown[check], re.DOTALL)
        assert verdict is not None, shown[check]
        assert float(verdict[2]) == points, shown[check]
        assert expected.because.get(check, "") in shown[check]


def _page_with(window: Any, address: str, path: str) -> Any:
    page = window.new_page()
    page.goto(f"{address}{path}?token=lab", timeout=START_SECONDS * 1000)
    return page


def test_a_students_jupyterlab_opens_the_labs_and_has_none_of_an_instructors_tools(
    window: Any, jupyter: tuple[Path, str]
) -> None:
    work, address = jupyter
    page = _page_with(window, address, "")
    page.wait_for_selector(".jp-MarkdownViewer h1:has-text('The labs')", timeout=START_SECONDS * 1000)
    page.wait_for_selector(".jp-MarkdownViewer a:has-text('Lab 2')")
    _picture(page, "start")
    text = page.inner_text("body")
    page.click("text=View >> nth=0")
    page.wait_for_selector(".lm-Menu-content")
    text += page.inner_text(".lm-Menu-content")
    for word in ("Nbgrader", "Formgrader", "Create Assignment", "Assignment List", "official Jupyter news"):
        assert word.lower() not in text.lower()
    assert page.request.get(f"{address}formgrader?token=lab").status == 404
    page.close()
    log = (work.parent / "jupyter.log").read_text()
    assert "nbgrader" not in log, log


VIEW = """%load_ext autograder
from autograder.checks import launch
from std_msgs.msg import String
----
%%node talker
import rclpy
from rclpy.node import Node
from std_msgs.msg import String


class Talker(Node):
    def __init__(self):
        super().__init__("talker")
        self.publisher = self.create_publisher(String, "a_topic_with_a_name_that_is_too_wide_for_windows/chatter", 10)
        self.create_timer(0.05, self.tick)

    def tick(self):
        print("tick " * 60)
        self.publisher.publish(String(data="hello"))


rclpy.init()
rclpy.spin(Talker())
----
with launch("talker") as ros:
    ros.node("/talker").expect()
    ros.topic("/a_topic_with_a_name_that_is_too_wide_for_windows/chater", String).expect_messages()
    ros.node("/talker").expect()
ros.score(2)
----
with launch("talker") as ros:
    ros.node("/talker").expect()
    # More is checked here when the lab is graded.
ros.score(2)
----
with launch("talker") as ros:
    with ros.part("the node has its name"):
        ros.node("/talker").expect()
    with ros.part("it publishes"):
        ros.topic("/chatter", String).expect_publisher()
ros.score({"the node has its name": 1, "it publishes": 2})
----
with launch("talker") as ros:
    heard = ros.topic("/a_topic_with_a_name_that_is_too_wide_for_windows/chatter", String).listen()
    ros.wait(lambda: heard.count > 2, within=60)
----
launch("talkr")"""

# Of every report: how far it reaches beyond its own box, its colours, and those of the page behind it.
REPORTS = """() => [...document.querySelectorAll('.jp-RenderedHTMLCommon > div')].map(report => {
  let behind = report;
  while (behind && getComputedStyle(behind).backgroundColor === 'rgba(0, 0, 0, 0)') behind = behind.parentElement;
  const box = report.getBoundingClientRect();
  const inside = [...report.querySelectorAll('*')].map(part => part.getBoundingClientRect().right);
  return {
    beyond: Math.max(0, ...inside.map(right => right - box.right)),
    ink: getComputedStyle(report).color,
    behind: behind ? getComputedStyle(behind).backgroundColor : 'rgb(255, 255, 255)',
  };
})"""


def _brightness(colour: str) -> float:
    red, green, blue, *opacity = (float(part) for part in re.findall(r"[\d.]+", colour))
    light = (0.2126 * red + 0.7152 * green + 0.0722 * blue) / 255
    return light if not opacity or light > 0 else 1 - opacity[0]  # black that lets some of a white page through


@pytest.mark.parametrize("theme", [pytest.param("JupyterLab Light", marks=pytest.mark.complete), "JupyterLab Dark"])
def test_reports_can_be_read_in_every_theme_and_in_a_narrow_window(
    window: Any, jupyter: tuple[Path, str], theme: str
) -> None:
    work, address = jupyter
    name = theme.split()[1].lower()
    cells = [
        {
            "cell_type": "code",
            "id": f"c{number}",
            "metadata": {},
            "outputs": [],
            "execution_count": None,
            "source": text,
        }
        for number, text in enumerate(VIEW.split("\n----\n"))
    ]
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    notebook = {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}
    (work / f"{name}.ipynb").write_text(json.dumps(notebook))
    settings = work.parent / "home" / "settings" / "@jupyterlab" / "apputils-extension" / "themes.jupyterlab-settings"
    settings.parent.mkdir(parents=True, exist_ok=True)
    settings.write_text(json.dumps({"theme": theme}))

    page, shown = run_all(window, address, name)

    for number, words in enumerate(("", "written", "failed", "holds so far", "partly passed", "Output of talker")):
        assert words in shown[number]["output"]
    assert "no cell of the saved notebook begins with" in shown[-1]["output"]
    for width in (1400, 600):
        page.set_viewport_size({"width": width, "height": 1600})
        page.wait_for_timeout(500)
        _picture(page, f"{name}-{width}")
        reports = page.evaluate(REPORTS)
        assert len(reports) == 3
        for report in reports:
            assert report["beyond"] <= 1, report
            assert abs(_brightness(report["ink"]) - _brightness(report["behind"])) > 0.5, report
            assert (_brightness(report["behind"]) < 0.5) == (name == "dark"), report
    _close(page, address, name)
