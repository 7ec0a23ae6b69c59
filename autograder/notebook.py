"""The IPython extension: `%load_ext autograder` brings the cell magics that write programs and files.

The programs lie in the folder `nodes` beside the notebook, where `launch` finds them, as they do at grading time.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from autograder.submission.magics import CELL_BYTES, BadNameError, CellFile, check_name

FOLDER = Path("nodes")
"""Where the programs and files of a notebook lie, beside it."""


def register(shell: Any) -> None:
    """Give an IPython shell the `%%node` and `%%file` magics, and start each cell's findings afresh.

    Programs of an earlier kernel are removed: one whose cell has been renamed or deleted since would still pass here,
    and be missing when the notebook is graded.
    """
    for path in FOLDER.glob("*"):
        if path.suffix in (".py", ".yaml", ".yml", ".json", ".csv"):
            path.unlink(missing_ok=True)
    for magic in ("node", "file"):
        shell.register_magic_function(_writer(magic), magic_kind="cell", magic_name=magic)
    shell.events.register("pre_run_cell", _begin_cell)


def _begin_cell(_info: object) -> None:
    from autograder.checks import session

    session.reset()


def _writer(magic: str) -> Any:
    def write(line: str, cell: str) -> None:
        name = line.strip()
        try:
            check_name(magic, name)
        except BadNameError as error:
            print(f"✗ not written: {error}")
            return
        if len(cell.encode("utf-8", "replace")) > CELL_BYTES:
            print(f"✗ not written: the cell is larger than {CELL_BYTES // 1024} KiB.")
            return
        print(write_file(CellFile(magic, name, cell)))

    write.__doc__ = f"Write the cell to a {'program' if magic == 'node' else 'file'} in the folder {FOLDER}."
    return write


def write_file(file: CellFile, folder: Path = FOLDER) -> str:
    """Write a cell's file, whole or not at all, and return what to tell the student in a line."""
    folder.mkdir(exist_ok=True)
    path = folder / file.file_name
    beside = folder / f".{file.file_name}.{os.getpid()}"
    beside.write_text(file.text, encoding="utf-8", errors="replace")
    beside.replace(path)
    kind = "node program" if file.magic == "node" else "file"
    defect = _defect(file)
    return f"{kind} {file.name} written" + (f", but {defect}" if defect else "")


def _defect(file: CellFile) -> str:
    """What keeps the file from being read at all, with the line as the notebook counts it; empty if nothing."""
    if file.magic == "node":
        try:
            compile(file.text, file.file_name, "exec", dont_inherit=True)
        except SyntaxError as error:
            # The cell's first line is the magic, which the file does not have.
            text = (error.text or "").strip()
            return f"line {(error.lineno or 0) + 1} of the cell is not Python: {error.msg}" + (
                f"\n    {text}" if text else ""
            )
        except (ValueError, RecursionError, MemoryError) as error:
            return f"it is not Python: {error}"
    elif file.name.endswith((".yaml", ".yml")):
        from autograder import student_yaml

        try:
            student_yaml.load(file.text)
        except student_yaml.StudentFileError as error:
            return error.because.removeprefix("the file, ").rstrip(".")
    elif file.name.endswith(".json"):
        import json

        try:
            json.loads(file.text)
        except (ValueError, RecursionError) as error:
            return f"it is not JSON: {error}"
    return ""
