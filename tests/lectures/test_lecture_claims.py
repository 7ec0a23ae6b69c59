"""What a lecture says was measured: each such assertion fails when the statement is made false.

Each lecture, and the page of exam questions, has a table of mutants, `tests/lecture_mutants/PAGE.yaml`: for each
statement a change that makes it false. One run of the page with changed programs shows for all of them at once whether
their assertions notice. The pages run side by side, because they wait most of the time.
"""

from __future__ import annotations

import ast
import json
import os
import re
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from pathlib import Path
from typing import Any

import nbformat
import pytest
import yaml
from kernels import own_sockets
from nbclient import NotebookClient
from places import ROOT

LECTURES = ROOT / "lectures"
MUTANTS = ROOT / "tests" / "lecture_mutants"
TABLES = sorted(MUTANTS.rglob("*.yaml"))
CELL = re.compile(r"^```\{code-cell\}[^\n]*\n(.*?)^```$", re.MULTILINE | re.DOTALL)
OPTIONS = re.compile(r"\A(?:---\n.*?\n---\n|(?::\w[^\n]*\n)+\n?)", re.DOTALL)
HELD = "HELD "
"""What stands before the result in the last cell's output."""
ENDED = "a cell ended with"
"""How a line on standard error begins that says which cell raised what."""
AT_ONCE = 3 * len(os.sched_getaffinity(0))
"""The pages that run at a time: each uses a CPU for about a sixth of its time."""
STARTS_WITHIN = 300
"""Seconds until a kernel must have started; several of them start together."""


class _Collected(ast.NodeTransformer):
    """Every `assert condition, "key"` notes its result; whatever goes wrong with it counts as false."""

    def visit_Assert(self, node: ast.Assert) -> ast.stmt:
        key = ast.unparse(node.msg) if node.msg else "'no key'"
        text = f"try:\n    _held[{key}] = bool({ast.unparse(node.test)})\nexcept Exception:\n    _held[{key}] = False"
        return ast.parse(text).body[0]


def cells_of(page: Path) -> list[str]:
    """The code cells of a page, without their options."""
    return [OPTIONS.sub("", cell) for cell in CELL.findall(page.read_text(encoding="utf-8"))]


def collecting(source: str) -> str:
    """A cell in which no statement but the last one's failure ends the run."""
    if source.lstrip().startswith("%") or "assert " not in source:
        return source
    return ast.unparse(_Collected().visit(ast.parse(source)))


def held(sources: list[str], folder: Path) -> dict[str, bool]:
    """Run cells in a kernel as the build does; for each statement whether its assertion held."""
    sources = ["_held = {}", *map(collecting, sources), f"import json\nprint({HELD!r} + json.dumps(_held))"]
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(source) for source in sources])
    path = os.pathsep.join([str(LECTURES / "_lib"), os.environ.get("PYTHONPATH", "")])
    client = NotebookClient(
        notebook, timeout=300, startup_timeout=STARTS_WITHIN, allow_errors=True, kernel_name="python3",
        config=own_sockets(), resources={"metadata": {"path": str(folder)}},
    )  # fmt: skip
    client.execute(env={**os.environ, "PYTHONPATH": path, "LECTURES": str(LECTURES)})
    for cell in notebook.cells:
        for output in cell.outputs:
            if output.output_type == "error":  # its statements do not hold for another reason than the page's programs
                print(f"{ENDED} {output.ename}: {output.evalue!r}\n    in: {cell.source[:60]!r}", file=sys.stderr)
    said: list[Any] = [output.get("text", "") for output in notebook.cells[-1].outputs]
    return dict(json.loads(next(text for text in said if text.startswith(HELD)).removeprefix(HELD)))


def page_of(table: Path) -> Path:
    """The page whose statements a table makes false."""
    return LECTURES / table.relative_to(MUTANTS).with_suffix(".md")


def keys_of(page: Path) -> set[str]:
    """The statements that a page asserts."""
    return set(re.findall(r'^assert .*?, "([a-z0-9-]+)"$', page.read_text(encoding="utf-8"), re.MULTILINE))


def mutated(sources: list[str], changes: list[dict[str, Any]]) -> list[str]:
    """The cells with every change made; a change that fits no cell, or several, is a mistake in the table."""
    sources = list(sources)
    for change in changes:
        fitting = [
            number
            for number, source in enumerate(sources)
            if change["old"] in source
            and source.startswith((f"%%node {change['cell']}\n", f"%%file {change['cell']}\n"))
        ]
        assert len(fitting) == 1, f"{change} fits {len(fitting)} cells"
        sources[fitting[0]] = sources[fitting[0]].replace(change["old"], change["new"])
    return sources


@pytest.mark.parametrize("table", TABLES, ids=lambda path: path.stem)
def test_each_statement_has_a_mutant(table: Path) -> None:
    changes = yaml.safe_load(table.read_text(encoding="utf-8"))
    page = page_of(table)
    assert {key for change in changes for key in change["breaks"]} == keys_of(page)
    mutated(cells_of(page), changes)


@pytest.fixture(scope="module")
def run(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Callable[[Path], dict[str, bool]]]:
    """Run the pages of all chosen tests side by side, the longest first; return what gives the result of one."""
    here = [item for item in request.session.items if item.path == request.path and "run" in item.fixturenames]
    chosen = [item.callspec.params["table"] for item in here]

    def mutated_page(table: Path, folder: Path) -> dict[str, bool]:
        changes = yaml.safe_load(table.read_text(encoding="utf-8"))
        return held(mutated(cells_of(page_of(table)), changes), folder)

    def new_folder(
        table: Path,
    ) -> Path:  # not in the pool: two threads that ask pytest for the first one disturb each other
        return tmp_path_factory.mktemp(table.stem)

    with ThreadPoolExecutor(AT_ONCE) as pool:
        longest_first = sorted(chosen, key=lambda table: -len(cells_of(page_of(table))))
        running = {table: pool.submit(mutated_page, table, new_folder(table)) for table in longest_first}

        def result(table: Path) -> dict[str, bool]:
            first = running[table].result()
            if not any(first.values()):
                return first
            wait(running.values())  # a busy machine can make a statement true, as it can make one false
            return mutated_page(table, new_folder(table))

        yield result


@pytest.mark.parametrize("table", TABLES, ids=lambda path: path.stem)
def test_each_assertion_fails_when_its_statement_is_false(table: Path, run: Callable[[Path], dict[str, bool]]) -> None:
    found = run(table)
    assert found.keys() == keys_of(page_of(table))
    assert [key for key, holds in found.items() if holds] == [], "these assertions do not notice"


if (
    __name__ == "__main__"
):  # python tests/lectures/test_lecture_claims.py 02_executors: which statements hold as the page is
    import tempfile

    for name in sys.argv[1:]:
        with tempfile.TemporaryDirectory() as place:
            print(json.dumps(held(cells_of(LECTURES / f"{name}.md"), Path(place)), indent=1))
