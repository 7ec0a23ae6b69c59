"""A real JupyterLab, and a notebook that is run in it from top to bottom."""

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

from places import ROOT
from served import address_of

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


def kernels(page: Any, address: str, name: str) -> list[dict[str, Any]]:
    """The kernel of a notebook, as the server describes it."""
    sessions = page.request.get(f"{address}api/sessions?token=lab").json()
    return [session["kernel"] for session in sessions if session["path"] == f"{name}.ipynb"]


def kernel_is_idle(kernels: list[dict[str, Any]]) -> bool:
    """Whether the server says that the page is connected to a kernel that waits for work."""
    return any(kernel["execution_state"] == "idle" and kernel["connections"] for kernel in kernels)


def _wait_for_a_prompt(page: Any, seconds: float) -> None:
    """Wait until a cell runs or has been run, or a dialog asks something, at most so many seconds."""
    until = time.monotonic() + seconds
    while time.monotonic() < until and not page.locator(".jp-Dialog").count():
        if not all("[ ]" in prompt for prompt in page.evaluate(PROMPTS)):
            return
        page.wait_for_timeout(200)


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
    # Cells that are chosen twice run twice, so a busy machine is given longer each time.
    patience = 2.0
    while all("[ ]" in prompt for prompt in page.evaluate(PROMPTS)):
        assert time.monotonic() < deadline, "Run All Cells runs no cell"
        if page.locator(".jp-Dialog").count():
            page.keyboard.press("Escape")
        elif kernel_is_idle(kernels(page, address, name)):
            page.click("text=Run >> nth=0")
            page.click("text='Run All Cells'")
            _wait_for_a_prompt(page, patience)
            patience *= 2
        page.wait_for_timeout(500)
    while any("*" in prompt or "[ ]" in prompt for prompt in page.evaluate(PROMPTS)):
        assert time.monotonic() < deadline, [c for c in page.evaluate(CELLS) if not re.search(r"\d", c["prompt"])]
        page.wait_for_timeout(500)
    page.wait_for_selector(".jp-Notebook-ExecutionIndicator[data-status='idle']", timeout=START_SECONDS * 1000)
    cells: list[dict[str, Any]] = page.evaluate(CELLS)
    assert not outside, f"the page asked for {outside}"
    return page, cells
