"""The Jupyter kernel in which the checks run: its cells, its files, and what it shows.

The checks use it as their `autograder.core.front_end`.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import re
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from autograder.core import interrupts
from autograder.core.results import CellResult, Status
from autograder.course.cells import cell_digest
from autograder.notebook.lab_state import Report
from autograder.notebook.program_folder import RENAMED, ProgramFolder, Written, notebook_of, shown

if TYPE_CHECKING:
    from autograder.checks.running_launch import RunningLaunch
    from autograder.graph.observer import Observer
    from autograder.notebook.saved_notebook import SavedNotebook
    from autograder.notebook.watch import Watch
    from autograder.notebook.world_view import WorldView
    from autograder.sandbox.running_program import RunningProgram

_SCORED = re.compile(r"\bscore\(")
_NOT_DEFINED = (
    "A cell above this check defines `{name}`, and it has not been run since the kernel started. Choose "
    "Run > Run All Above Selected Cell in the menu, and then run this check again."
)
"""A check is locked, so an undefined name in it is not the student's mistake. It happens after a restart."""
_EXPECTS = re.compile(r"\bscore\(|\.(expect|require)")
"""The calls by which a cell requests a verdict."""
_CELL_ID = re.compile(r"[A-Za-z0-9_-]{1,64}")
"""The ID of a cell as notebooks save it (nbformat). Visual Studio Code sends the address of a document instead."""
NO_VERDICT = "Interrupted: this check has no verdict. Run its cell again."
"""The message of an interrupted check, wherever it was interrupted."""

_READY_POLL = 0.1
"""The seconds between two checks whether the wait was interrupted."""


class Kernel:
    """An IPython shell with the kit's extension.

    Args:
        shell: the shell of IPython.
    """

    def __init__(self, shell: Any) -> None:
        """Find the notebook's folder, and prepare a thread that loads what a first launch needs."""
        self.shell = shell
        notebook = notebook_of(shell.user_ns, dict(os.environ))
        self.folder = ProgramFolder(notebook, notebook.parent if notebook else Path.cwd(), _cells_of(notebook))
        self.cell, self.cell_id = "", ""
        self._began = 0
        self._in_cell = False
        self.reports: dict[str, Report] = {}
        """The last reports of the checks in this kernel, by `cell_digest`."""
        self._watch: Watch | None = None
        self._warmed = threading.Thread(target=_warm_up, name="warm-up")

    def start(self) -> None:
        """Begin to load. This is separate from `__init__` because it needs `front_end.active`."""
        if self.updates_outputs:
            _hold_interrupts(self.shell)
        self._warmed.start()
        atexit.register(self.folder.close)

    def ready(self) -> None:
        """Wait until loading is complete."""
        while self._warmed.is_alive():
            self._warmed.join(_READY_POLL)
            interrupts.here()

    # The running cell.

    def begin_cell(self, info: Any) -> None:
        """Note the cell that begins, and forget the findings of the last one."""
        self.cell = str(info.raw_cell or "")
        self._in_cell = True
        interrupts.say(NO_VERDICT if _EXPECTS.search(self.cell) else "")
        told = str(getattr(info, "cell_id", "") or "")
        self.cell_id = told if _CELL_ID.fullmatch(told) else ""
        self._began = self.number
        if self._watch is not None:
            self._watch.new_cell()
        findings = _findings()
        if findings is not None:
            findings.reset()

    def end_cell(self, result: Any) -> None:
        """Keep the report of a check, and show expectations that were checked in a cell without a score."""
        self._in_cell = False
        self._end_block()
        if result is None or isinstance(result.error_in_exec, KeyboardInterrupt):
            self._forget_verdict()
        else:
            self._keep_verdict(result)
            if self.scored and isinstance(result.error_in_exec, NameError):
                print(_NOT_DEFINED.format(name=result.error_in_exec.name))

    def _end_block(self) -> None:
        """Stop the launch of a block, wherever its cell ended."""
        check = _current_check()
        block = check.block if check is not None else None
        if block is not None:
            block.stop()

    def _forget_verdict(self) -> None:
        """Forget the findings and the earlier report of a check that was interrupted."""
        if self.scored:
            self.reports[cell_digest(self.cell)] = Report(None, self._began)
        findings = _findings()
        if findings is not None:
            findings.reset()

    def _keep_verdict(self, result: Any) -> None:
        found = getattr(result.result, "result", None)
        if isinstance(found, CellResult) and found.max_points:
            self.reports[cell_digest(self.cell)] = Report(found, self._began)
        findings = _findings()
        if findings is not None and findings.outcomes:
            from autograder.checks.scoring import unscored

            report = unscored()
            # If the cell expected nothing, steps that succeeded are not a verdict: a goal may have been aborted.
            if report is not None and (_EXPECTS.search(self.cell) or report.result.status is not Status.PASSED):
                from IPython.display import display

                display(report)

    @property
    def scored(self) -> bool:
        """Whether the running cell is a check, which is a cell that requests a score."""
        return bool(_SCORED.search(self.cell))

    @property
    def programs(self) -> Path:
        """The folder with the programs and files of the cells."""
        return self.folder.path

    def watch(self, observer: Observer, programs: Callable[[], Sequence[RunningProgram]]) -> Watch:
        """Begin to show what happens in a launch. The programs' output is shown only if the cell is not a check."""
        from autograder.notebook.watch import Watch

        self._watch = Watch(observer, programs, streams=not self.scored, updates=self.updates_outputs)
        return self._watch

    def show(
        self,
        running: RunningLaunch,
        listen: Sequence[tuple[str, type]],
        scan: str,
        buttons: Mapping[str, Callable[[], object]],
    ) -> WorldView:
        """Begin to show the world of a launch, live, with the last messages of these topics and the lab's buttons."""
        from autograder.notebook.world_extras import Extras
        from autograder.notebook.world_view import WorldView

        scored = lambda: self._in_cell and self.scored  # noqa: E731
        return WorldView(running, Extras(listen, scan, buttons), lambda: self._in_cell, scored)

    @property
    def number(self) -> int:
        """The number in the brackets beside the running cell."""
        # The shell's own count is that of the next cell in some releases of IPython, and of this cell in others.
        return len(self.shell.history_manager.input_hist_parsed) - 1

    @property
    def updates_outputs(self) -> bool:
        """Whether the output of a cell can be updated while it runs; in a terminal, output can only be added."""
        return getattr(self.shell, "kernel", None) is not None

    # The files of the cells.

    def has(self, file_name: str) -> bool:
        """Whether a cell has written this file since the kernel started."""
        return file_name in self.folder.written and (self.folder.path / file_name).is_file()

    def saved(self) -> SavedNotebook | None:
        """Return the notebook as it is on disk; None if it is not known which one it is."""
        from autograder.notebook.saved_notebook import SavedNotebook

        return SavedNotebook(self.folder.notebook) if self.folder.notebook else None

    def why_missing(self, magic: str, name: str) -> tuple[str, str]:
        """Return why there is no such file, and what to do."""
        first = f"%%{magic} {name}"
        saved = self.saved()
        file_name = f"{name}.py" if magic == "node" else name
        if file_name in self.folder.written:
            because = f"{shown(self.folder.path / file_name)} is gone: it was removed after its cell was run."
            return because, f"Run the cell `{first}` again, then this one."
        if saved is not None and saved.readable and not saved.has(file_name):
            return (
                f"There is no `{name}`: no cell of the saved notebook begins with `{first}`.",
                "Compare the name with the first line of its cell. If the cell is new, run it first.",
            )
        because = f"The cell `{first}` has not been run since the kernel started, so there is no `{name}` yet."
        return because, f"Run the cell `{first}` first, then this one."

    def used(self, file_names: set[str]) -> list[Written]:
        """Return these files as cells wrote them, and the cells' modules that they import."""
        found: dict[str, Written] = {}
        front = sorted(file_names)
        while front:
            name = front.pop()
            written = self.folder.written.get(name)
            if written is None or name in found:
                continue
            found[name] = written
            front += [other for other in self.folder.written if _imports(written, other)]
        return sorted(found.values(), key=lambda written: written.number)

    def blank(self, file_names: set[str]) -> dict[str, bool]:
        """Return, for each of these files that is an answer, whether its cell is still as students receive it."""
        saved = self.saved()
        if saved is None:
            return {}
        written = [self.folder.written[name] for name in file_names if name in self.folder.written]
        return {one.file.file_name: saved.is_blank(one) for one in written if saved.is_answer(one)}

    def origin(self, file_names: set[str]) -> str:
        """Name the cells from which these files come: `heartbeat from cell [7], run at 14:03:12`."""
        saved = self.saved()
        return "; ".join(
            f"`{written.file.name}` from {written.origin}"
            + (", not saved yet" if saved and saved.lacks(written) else "")
            for written in self.used(file_names)
        )

    def remarks(self, file_names: set[str]) -> list[str]:
        """Return sentences that say where the files that were run differ from what would be graded."""
        saved = self.saved()
        used = self.used(file_names)
        if saved is not None and not saved.path.is_file():
            return [
                f"{shown(saved.path)} no longer exists, so the kit cannot tell whether this is what would be graded."
                f" {RENAMED}"
            ]
        told = [remark for written in used if saved and (remark := saved.remark(written))]
        for written in used:
            if self.folder.changed_by_hand(written.file.file_name):
                path = shown(self.folder.path / written.file.file_name)
                told.append(f"{path} differs from what its cell wrote. Grading uses the cell, so run the cell again.")
        for name in self.folder.foreign():
            if any(_imports(written, name) or _names(written, name) for written in used):
                path = shown(self.folder.path / name)
                first = f"%%node {name.removesuffix('.py')}" if name.endswith(".py") else f"%%file {name}"
                told.append(
                    f"No cell wrote {path}, so it is missing when the notebook is graded. Put its text into a cell that"
                    f" begins with `{first}`."
                )
        return told


def _imports(written: Written, file_name: str) -> bool:
    if not file_name.endswith(".py") or written.file.magic != "node":
        return False
    module = re.escape(file_name.removesuffix(".py"))
    return bool(re.search(rf"^\s*(?:from|import)\b.*\b{module}\b", written.file.text, re.MULTILINE))


def _names(written: Written, file_name: str) -> bool:
    """Whether a text contains the name of a file, in quotes or at the end of a path in quotes."""
    return bool(re.search(rf"""["'/]{re.escape(file_name)}["']""", written.file.text))


def _cells_of(notebook: Path | None) -> Callable[[str], bool]:
    """Return a function that says whether the saved notebook has a cell for a file; it returns True if unknown."""

    def has(file_name: str) -> bool:
        from autograder.notebook.saved_notebook import SavedNotebook

        saved = SavedNotebook(notebook) if notebook else None
        return saved is None or not saved.readable or saved.has(file_name)

    return has


def _hold_interrupts(shell: Any) -> None:
    """Hold interrupts back while the kit works, from the moment at which the kernel begins to handle a request."""
    kernel = shell.kernel
    before, after = kernel.pre_handler_hook, kernel.post_handler_hook

    def begin() -> None:
        before()
        interrupts.begin(shell.user_ns)

    def end() -> None:
        interrupts.end()
        after()

    kernel.pre_handler_hook, kernel.post_handler_hook = begin, end
    interrupts.begin(shell.user_ns)


def _current_check() -> Any:
    """Return the running check; None if the checks have not been imported completely yet."""
    return getattr(sys.modules.get("autograder.checks.current"), "check", None)


def _findings() -> Any:
    """Return what the cell's checks have found so far; None if there is no check."""
    check = _current_check()
    return check.findings if check is not None else None


def now() -> float:
    """Return the seconds since 1970."""
    return time.time()


def _warm_up() -> None:
    """Load the launcher, the checks and the middleware, so that the first launch does not have to wait for them."""
    with contextlib.suppress(Exception):
        from autograder.checks import current
        from autograder.graph.domains import claim_domain
        from autograder.graph.observer import Observer
        from autograder.sandbox.environment import profile_environment

        os.environ.update(profile_environment())
        os.environ.pop("ROS_AUTOMATIC_DISCOVERY_RANGE", None)
        _ = current.check.sandbox
        domain = claim_domain()
        Observer(domain.id, left=domain.release).close()
