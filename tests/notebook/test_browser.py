"""The labs in a real JupyterLab and a real browser: run from top to bottom, they give the verdicts of grading.

The browser is Debian's chromium. Where there is none the test is skipped, except in CI.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import sample_class
from jupyter_lab import START_SECONDS, jupyter_lab, kernels, run_all
from places import ROOT

from autograder.course.lab import lab_names, load_lab


@pytest.fixture(scope="module")
def jupyter(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, str]]:
    with jupyter_lab(tmp_path_factory.mktemp("jupyter")) as started:
        yield started


@pytest.fixture(scope="module")
def window(browser: Any) -> Iterator[Any]:
    """Where pages are opened: they share what the browser has read and compiled of JupyterLab."""
    opened = browser.new_context(viewport={"width": 1400, "height": 900})
    opened.set_default_timeout(START_SECONDS * 1000)
    yield opened
    opened.close()


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

# JupyterLab lays its panels out anew some time after the window has got another width.
FITS = """width => window.innerWidth === width
  && [...document.querySelectorAll('.jp-Notebook')].every(one => one.getBoundingClientRect().right <= width)"""


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
        page.wait_for_function(FITS, arg=width)
        _picture(page, f"{name}-{width}")
        reports = page.evaluate(REPORTS)
        assert len(reports) == 3
        for report in reports:
            assert report["beyond"] <= 1, report
            assert abs(_brightness(report["ink"]) - _brightness(report["behind"])) > 0.5, report
            assert (_brightness(report["behind"]) < 0.5) == (name == "dark"), report
    _close(page, address, name)
