"""The experiments of a lab that no check grades: what a student sees, before and after the repair."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import nbformat
from kernels import own_sockets
from nbclient import NotebookClient
from places import ROOT


def run(lab: str, folder: Path, cells: tuple[str, ...], repair: tuple[str, str]) -> list[str]:
    """Run the cells of a released lab that begin in these ways, with a line repaired; return what each one shows."""
    shutil.copytree(ROOT / "labs" / lab, folder / lab)
    notebook = nbformat.read(folder / lab / f"{lab}.ipynb", as_version=4)
    notebook.cells = [cell for begin in cells for cell in notebook.cells if cell.source.startswith(begin)]
    assert len(notebook.cells) == len(cells)
    assert sum(cell.source.count(repair[0]) for cell in notebook.cells) == 1
    for cell in notebook.cells:
        cell.source = cell.source.replace(*repair)
    NotebookClient(
        notebook, timeout=600, startup_timeout=300, kernel_name="python3", config=own_sockets(),
        resources={"metadata": {"path": str(folder / lab)}},
    ).execute()  # fmt: skip
    return [
        "".join(output.get("text", output.get("data", {}).get("text/plain", "")) for output in cell.outputs)
        for cell in notebook.cells
    ]


def test_the_repaired_meter_says_what_each_profile_costs(tmp_path: Path) -> None:
    """Lab 5: every picture arrives with reliable, and the picture of the arrivals has a row for each end."""
    shown = run(
        "lab5_qos", tmp_path,
        ("%load_ext autograder", "%%node sender\n", "%%node meter\n", "CASES = (", 'ros.draw.arrivals("/image")'),
        ("published = self.get_clock().now()", "published = Time.from_msg(picture.header.stamp)"),
    )  # fmt: skip
    told = re.findall(r"(\d+) bytes, RELIABLE, (\w+):\n.*?(\d+) of 50 pictures, latency", shown[3])
    sizes, durabilities = ("1000", "300000"), ("VOLATILE", "TRANSIENT_LOCAL")
    assert told == [(size, durability, "50") for size in sizes for durability in durabilities]
    assert "/sender publishes: 50 messages" in shown[4]
    assert "/meter takes: 50 messages" in shown[4]
