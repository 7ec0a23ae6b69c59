"""The Jupyter kernel that the checks run in: its cells, its files, and where to show what happens.

To the checks it is their `autograder.core.front_end`.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import re
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from autograder.core import interrupts
from autograder.core.results import CellResult, Status
from autograder.course.cells import cell_digest
from autograder.notebook.lab_state import Report
from autograder.notebook.program_folder import ProgramFolder, Written, notebook_of, shown

if TYPE_CHECKING:
    from autograder.graph.observer import Observer
    from autograder.notebook.saved_notebook import SavedNotebook
    from autograder.notebook.watch import Watch
    from autograder.sandbox.running_program import RunningProgram

_SCORED = re.compile(r"\bscore\(")
_NOT_DEFINED = (
    "A cell above this check defines `{name}`, and it has not been run since the kernel started. Choose "
    "Run > Run All Above Selected Cell in the menu, and then run this check again."
)
"""A check is locked, so a name that it does not know is not the student's mistake; it happens after a restart."""
_EXPECTS = re.compile(r"\bscore\(|\.(expect|require)")
"""How a cell that makes a check of something asks for a verdict."""
_CELL_ID = re.compile(r"[A-Za-z0-9_-]{1,64}")
"""A cell's id as notebooks save it (nbformat); Visual Studio Code tells the address of a document in its place."""
NO_VERDICT = "Interrupted: this check has no verdict. Run its cell again."
"""What such a cell says that was interrupted, wherever that found it."""

_READY_POLL = 0.1
"""Seconds between two looks whether somebody has interrupted the wait."""


class Kernel:
    """One IPython shell with the kit's extension.

    Args:
        shell: IPython's.
    """

    def __init__(self, shell: Any) -> None:
        """Find the notebook's folder, and load in the background what a first launch needs."""
        self.shell = shell
        notebook = notebook_of(shell.user_ns, dict(os.environ))
        self.folder = ProgramFolder(notebook, notebook.parent if notebook else Path.cwd(), _cells_of(notebook))
        self.cell, self.cell_id = "", ""
        self._began = 0
        self.reports: dict[str, Report] = {}
        """What the checks of this kernel said last, by `cell_digest`."""
        self._watch: Watch | None = None
        self._warmed = threading.Thread(target=_warm_up, name="warm-up")

    def start(self) -> None:
        """Begin to load; apart from the rest, because this needs `active`."""
        if self.updates_outputs:
            _hold_interrupts(self.shell)
        self._warmed.start()
        atexit.register(self.folder.close)

    def ready(self) -> None:
        """Wait until the loading is done."""
        while self._warmed.is_alive():
            self._warmed.join(_READY_POLL)
            interrupts.here()

    # What runs.

    def begin_cell(self, info: Any) -> None:
        """Note the cell that begins, and forget what the last one found."""
        self.cell = str(info.raw_cell or "")
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
        """Keep what a check said, and show what was expected in a cell that asked for no score."""
        self._end_block()
        if result is None or isinstance(result.error_in_exec, KeyboardInterrupt):
            self._forget_verdict()
        else:
            self._keep_verdict(result)
            if self.scored and isinstance(result.error_in_exec, NameError):
                print(_NOT_DEFINED.format(name=result.error_in_exec.name))

    def _end_block(self) -> None:
        """No launch of a block outlives its cell, wherever that was left."""
        check = _current_check()
        block = check.block if check is not None else None
        if block is not None:
            block.stop()

    def _forget_verdict(self) -> None:
        """What an interrupted check had found out says nothing, and neither does what it said before."""
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
            # Where nothing was expected, what went well on the way is no verdict: a goal may have been aborted.
            if report is not None and (_EXPECTS.search(self.cell) or report.result.status is not Status.PASSED):
                from IPython.display import display

                display(report)

    @property
    def scored(self) -> bool:
        """Whether the cell that runs is a check: it asks for a score."""
        return bool(_SCORED.search(self.cell))

    @property
    def programs(self) -> Path:
        """The folder in which the programs and files of the cells lie."""
        return self.folder.path

    def watch(self, observer: Observer, programs: Callable[[], Sequence[RunningProgram]]) -> Watch:
        """Begin to show what goes on in a launch; what programs print is shown where no check is made of it."""
        from autograder.notebook.watch import Watch

        self._watch = Watch(observer, programs, streams=not self.scored, updates=self.updates_outputs)
        return self._watch

    @property
    def number(self) -> int:
        """The number in the brackets beside the cell that runs."""
        # The shell's own count is that of the next cell in some releases of IPython, and of this one in others.
        return len(self.shell.history_manager.input_hist_parsed) - 1

    @property
    def updates_outputs(self) -> bool:
        """Whether what a cell shows can change while it runs; a terminal can only add to it."""
        return getattr(self.shell, "kernel", None) is not None

    # What cells wrote.

    def has(self, file_name: str) -> bool:
        """Whether a cell wrote this file since the kernel began."""
        return file_name in self.folder.written and (self.folder.path / file_name).is_file()

    def saved(self) -> SavedNotebook | None:
        """Return the notebook as it is on disk; None where nobody knows which it is."""
        from autograder.notebook.saved_notebook import SavedNotebook

        return SavedNotebook(self.folder.notebook) if self.folder.notebook else None

    def why_missing(self, magic: str, name: str) -> tuple[str, str]:
        """Why there is no such file, and what to do."""
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
        """Return what cells wrote of these files, and of the modules among the cells' files that they import."""
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
        """Return of each of these files that is an answer whether its cell is still as students receive it."""
        saved = self.saved()
        if saved is None:
            return {}
        written = [self.folder.written[name] for name in file_names if name in self.folder.written]
        return {one.file.file_name: saved.is_blank(one) for one in written if saved.is_answer(one)}

    def origin(self, file_names: set[str]) -> str:
        """Name the cells that these files came from: `heartbeat from cell [7], run at 14:03:12`."""
        saved = self.saved()
        return "; ".join(
            f"`{written.file.name}` from {written.origin}"
            + (", not saved yet" if saved and saved.lacks(written) else "")
            for written in self.used(file_names)
        )

    def remarks(self, file_names: set[str]) -> list[str]:
        """Say where what was run differs from what would be graded."""
        saved = self.saved()
        used = self.used(file_names)
        if saved is not None and not saved.path.is_file():
            return [
                f"{shown(saved.path)} no longer exists, so the kit cannot tell whether this is what would be graded. If"
                " you renamed the notebook, shut down its kernel and open it again."
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
    """Whether a text has the name of a file in it, in quotes or at the end of a path."""
    return bool(re.search(rf"""["'/]{re.escape(file_name)}["']""", written.file.text))


def _cells_of(notebook: Path | None) -> Callable[[str], bool]:
    """Whether the saved notebook has a cell for a file; true where nobody knows."""

    def has(file_name: str) -> bool:
        from autograder.notebook.saved_notebook import SavedNotebook

        saved = SavedNotebook(notebook) if notebook else None
        return saved is None or not saved.readable or saved.has(file_name)

    return has


def _hold_interrupts(shell: Any) -> None:
    """Let interrupts wait while the kit works; from the moment at which the kernel begins with what it is asked for."""
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
    """The check that runs; None before somebody has imported the checks, and while that is under way."""
    return getattr(sys.modules.get("autograder.checks.current"), "check", None)


def _findings() -> Any:
    """What the cell's checks have found so far, if there are any."""
    check = _current_check()
    return check.findings if check is not None else None


def now() -> float:
    """Seconds since 1970."""
    return time.time()


def _warm_up() -> None:
    """Load the launcher, the checks and the middleware, so that the first launch need not wait for them."""
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
