"""The labs in a real JupyterLab and a real browser: run from top to bottom, they give the verdicts of grading.

The browser is Debian's chromium. Where there is none the test is skipped, except in CI.
"""

from __future__ import annotations

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

from autograder.submission.lab import Lab, lab_names, load_lab

ROOT = Path(__file__).resolve().parent.parent
START_SECONDS, RUN_SECONDS = 90, 240
"""Far beyond what it takes (5 s and 35 s on two cores), for a machine that does much else."""

# All cells in the page at once: JupyterLab otherwise keeps only those in view.
SETTINGS = {"@jupyterlab/notebook-extension": {"tracker": {"windowingMode": "none"}}}

# Of every code cell, in order: its source, the prompt beside it, the text of its outputs, and whether one is an error.
CELLS = """() => [...document.querySelectorAll('.jp-CodeCell')].map(cell => ({
  prompt: cell.querySelector('.jp-InputArea-prompt').textContent,
  output: [...cell.querySelectorAll('.jp-OutputArea-output')].map(output => output.innerText).join('\\n'),
  error: !!cell.querySelector('[data-mime-type="application/vnd.jupyter.error"]'),
}))"""


@pytest.fixture
def jupyter(tmp_path: Path) -> Iterator[tuple[Path, str]]:
    """Start JupyterLab in an empty folder, untouched by this user's own settings; gives the folder and the address."""
    work, home = tmp_path / "labs", tmp_path / "home"
    work.mkdir()
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
    command = [sys.executable, "-m", "jupyter", "lab", "--no-browser", "--ServerApp.port=0", "--ServerApp.ip=127.0.0.1"]
    command += [f"--ServerApp.root_dir={work}", "--IdentityProvider.token=lab", "--LabApp.news_url=", "--allow-root"]
    with (tmp_path / "jupyter.log").open("w") as log:
        server = subprocess.Popen(command, cwd=work, env=environment, stdout=log, stderr=subprocess.STDOUT)
        try:
            yield work, _address(home / "runtime", server, tmp_path / "jupyter.log")
        finally:
            server.terminate()
            try:
                server.wait(timeout=20)
            except subprocess.TimeoutExpired:
                server.kill()
                server.wait()


def _address(runtime: Path, server: subprocess.Popen[bytes], log: Path) -> str:
    deadline = time.monotonic() + START_SECONDS
    while time.monotonic() < deadline and server.poll() is None:
        for path in runtime.glob("jpserver-*.json"):
            try:
                return str(json.loads(path.read_text())["url"])
            except (ValueError, KeyError):  # still being written
                pass
        time.sleep(0.1)
    raise AssertionError(f"JupyterLab did not start:\n{log.read_text()[-3000:]}")


def kernel_is_idle(kernels: list[dict[str, Any]]) -> bool:
    """Whether the server says that the page is connected to a kernel that waits for work."""
    return any(kernel["execution_state"] == "idle" and kernel["connections"] for kernel in kernels)


def _run_all(browser: Any, address: str, lab: Lab) -> list[dict[str, Any]]:
    """Open the lab, choose Run > Run All Cells, and give its code cells once the last one has been run."""
    page = browser.new_page(viewport={"width": 1400, "height": 900})
    outside: list[str] = []
    own = (address, address.replace("http", "ws"), "data:", "blob:")
    page.on("request", lambda request: None if request.url.startswith(own) else outside.append(request.url))
    page.goto(f"{address}lab/tree/{lab.name}.ipynb?token=lab", timeout=START_SECONDS * 1000)
    page.wait_for_selector(".jp-Notebook .jp-CodeCell", timeout=START_SECONDS * 1000)
    page.wait_for_selector(".jp-Notebook-ExecutionIndicator[data-status='idle']", timeout=START_SECONDS * 1000)
    deadline = time.monotonic() + RUN_SECONDS
    # What is chosen while JupyterLab still connects to the kernel is not done; a dialog says so, or nothing does.
    while all("[ ]" in cell["prompt"] for cell in page.evaluate(CELLS)):
        assert time.monotonic() < deadline, "Run All Cells runs no cell"
        if page.locator(".jp-Dialog").count():
            page.keyboard.press("Escape")
        elif kernel_is_idle(page.request.get(f"{address}api/kernels?token=lab").json()):
            page.click("text=Run >> nth=0")
            page.click("text='Run All Cells'")
        page.wait_for_timeout(2000)
    while any("*" in cell["prompt"] or "[ ]" in cell["prompt"] for cell in page.evaluate(CELLS)):
        assert time.monotonic() < deadline, [c for c in page.evaluate(CELLS) if not re.search(r"\d", c["prompt"])]
        page.wait_for_timeout(500)
    page.wait_for_selector(".jp-Notebook-ExecutionIndicator[data-status='idle']", timeout=30_000)
    cells: list[dict[str, Any]] = page.evaluate(CELLS)
    screenshot = os.environ.get("LAB_SCREENSHOT")
    if screenshot:
        page.screenshot(path=f"{screenshot}/{lab.name}.png")
    page.close()
    assert not outside, f"the page asked for {outside}"
    return cells


@pytest.mark.parametrize(
    ("lab_name", "student"), [*((lab, "solution") for lab in lab_names(ROOT)), ("lab2_executors", "e03_no_groups")]
)
def test_the_lab_runs_top_to_bottom_with_the_verdicts_of_grading(
    browser: Any, jupyter: tuple[Path, str], tmp_path: Path, lab_name: str, student: str
) -> None:
    work, address = jupyter
    lab = load_lab(ROOT, lab_name)
    handed_in = sample_class.build_student(lab, student, tmp_path) / f"{lab.name}.ipynb"
    shutil.copy(handed_in, work)
    expected = sample_class.expected(lab, student)
    sources = [cell for cell in json.loads(handed_in.read_text())["cells"] if cell["cell_type"] == "code"]

    cells = _run_all(browser, address, lab)

    assert len(cells) == len(sources)
    assert [cell["output"] for cell in cells if cell["error"]] == []
    shown = {}
    for source, cell in zip(sources, cells, strict=True):
        grade_id = source["metadata"].get("nbgrader", {}).get("grade_id", "")
        if grade_id in expected.points:
            shown[grade_id] = cell["output"]
    assert shown.keys() == expected.points.keys()
    # The student's copy has no hidden tests: what only these find, it cannot show.
    only_hidden = {check for check in expected.points if check.endswith(("_other", "_one_cpu", "_four"))}
    for check, points in expected.points.items():
        verdict = re.search(r"(passed|failed).*?(\d+) of (\d+) points", shown[check], re.DOTALL)
        assert verdict is not None, shown[check]
        if points == 0 and check in only_hidden:
            continue
        assert float(verdict[2]) == points, shown[check]
        assert expected.because.get(check, "") in shown[check]
