"""The IPython extension: `%load_ext autograder` brings the cell magics that write programs and files.

The programs lie in a folder of the notebook's own, `nodes/NAME OF THE NOTEBOOK`, where `launch` finds them.
"""

from __future__ import annotations

from typing import Any

from autograder import kernel
from autograder.kernel_folder import Written, shown
from autograder.submission.magics import CELL_BYTES, BadNameError, CellFile, check_free, check_name, parse

_NODE_HELP = """Write the rest of the cell to a node program, which `launch` and the checks then start.

    %%node talker
    import rclpy
    ...

The name has small letters, digits and underscores, and no `.py`. The cell is not run here: the program runs as a
process of its own, like one that you start in a terminal. It lies in the folder `nodes` beside the notebook. After a
change run the cell again, and then its check. Other programs can import it: `import talker`.
"""

_FILE_HELP = """Write the rest of the cell to a file: parameters, a launch file, or a table of answers.

    %%file camera.yaml
    /camera:
      ros__parameters:
        rate: 10.0

The name has no folder and ends in .yaml, .yml, .json or .csv. The file lies in the folder `nodes` beside the notebook.
After a change run the cell again, and then its check.
"""


def register(shell: Any) -> None:
    """Give an IPython shell the `%%node` and `%%file` magics, and start each cell's findings afresh.

    Programs of an earlier kernel do not count: one whose cell has been renamed or deleted since would still pass here,
    and be missing when the notebook is graded. Those of this kernel stay, also when the extension is loaded again.
    """
    for magic, text in (("node", _NODE_HELP), ("file", _FILE_HELP)):
        shell.register_magic_function(_writer(magic, text), magic_kind="cell", magic_name=magic)
    if kernel.active is not None and kernel.active.shell is shell:
        return
    kernel.active = kernel.Kernel(shell)
    kernel.active.start()
    shell.events.register("pre_run_cell", kernel.active.begin_cell)
    shell.events.register("post_run_cell", kernel.active.end_cell)
    for sentence in kernel.active.folder.kept:
        print(sentence)


def _writer(magic: str, text: str) -> Any:
    def write(line: str, cell: str) -> None:
        try:
            print("\n".join(_write(magic, line.strip(), cell)))
        except BadNameError as error:
            print(f"✗ not written: {error}")
        except OSError as error:
            print(f"✗ not written: {error.filename or 'the file'}: {error.strerror or error}")

    write.__doc__ = text
    return write


def _write(magic: str, name: str, cell: str) -> list[str]:
    """Write a cell's file and return what to tell the student.

    Raises:
        BadNameError: it cannot have this name.
        OSError: it cannot be written.
    """
    check_name(magic, name)
    here = kernel.active
    assert here is not None
    whole = here.cell.replace("\r\n", "\n")
    file = _parsed(whole)
    if file is None or (file.magic, file.name) != (magic, name):  # called from other code, not by its own cell
        whole = f"%%{magic} {name}\n{cell}"
        file = parse(whole) or CellFile(magic, name, cell)
    check_free(file)
    if len(whole.encode("utf-8", "replace")) > CELL_BYTES:
        return [f"✗ not written: the cell is larger than {CELL_BYTES // 1024} KiB."]
    told = here.folder.write(Written(file, whole, here.cell_id, here.number, kernel.now()))
    kind = "node program" if magic == "node" else "file"
    where = f" ({shown(here.folder.path / file.file_name)})" if here.folder.notebook else ""
    defect = _defect(file)
    return [*told, f"{kind} {name} written{where}" + (f", but {defect}" if defect else "")]


def _parsed(source: str) -> CellFile | None:
    try:
        return parse(source)
    except BadNameError:
        return None


def _defect(file: CellFile) -> str:
    """What keeps the file from being read at all, with the line as the notebook counts it; empty if nothing."""
    if file.magic == "node":
        try:
            compile(file.text, file.file_name, "exec", dont_inherit=True)
        except SyntaxError as error:
            text = (error.text or "").strip()
            return f"line {error.lineno or 0} of the cell is not Python: {error.msg}" + (
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
        import json  # the magic above is line 1

        try:
            json.loads(file.text)
        except json.JSONDecodeError as error:
            return f"line {error.lineno + 1} of the cell is not JSON: {error.msg}"
        except (ValueError, RecursionError) as error:
            return f"it is not JSON: {error}"
    return ""
