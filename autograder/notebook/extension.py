"""The IPython extension: `%load_ext autograder` registers the cell magics that write programs and files.

The programs are written to the notebook's own folder, `nodes/NAME OF THE NOTEBOOK`, where `launch` finds them.
"""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, Any

from autograder.core import front_end
from autograder.core.errors import KitError
from autograder.course.cells import CELL_BYTES, BadNameError, CellFile, check_free, check_name, parse
from autograder.course.paths import built_book, course_root, is_students_kit, trusted_course
from autograder.course.settings import NO_BOOK, Book, read_book
from autograder.notebook.kernel import Kernel, now
from autograder.notebook.magics import lab_magic, register_completion, ros2_magic
from autograder.notebook.program_folder import Written, shown
from autograder.setup.places import ROOT

if TYPE_CHECKING:
    from autograder.checks.scoring import Score

_NODE_HELP = """Write the rest of the cell to a node program, which `launch` and the checks then start.

    %%node talker
    import rclpy
    ...

The name consists of lower-case letters, digits and underscores, without `.py`. The cell itself is not run. Instead, the
program runs as a separate process, like a program that you start in a terminal. Its file is in the folder `nodes`
beside the notebook. After you have changed the cell, run the cell again, and then its check. Other programs can import
it: `import talker`.
"""

_FILE_HELP = """Write the rest of the cell to a file: parameters, a launch file, or a table of answers.

    %%file camera.yaml
    /camera:
      ros__parameters:
        rate: 10.0

The name contains no folder and ends with .yaml, .yml, .json or .csv; the name of a file in a package begins with the
package's folder, as in `%%file src/car_sensors/package.xml`. The file is in the folder `nodes` beside the notebook.
After you have changed the cell, run the cell again, and then its check.
"""

_ANEW = "Correct this and run the cell again. Until then, the checks use what the cell wrote before."


def register(shell: Any) -> None:
    """Register the `%%node`, `%%file`, `%ros2` and `%lab` magics in an IPython shell, and hooks for each cell.

    The hooks make each cell begin without findings. Programs of an earlier kernel do not count: if the cell of a
    program had been renamed or deleted since then, the program would pass here, but would be missing when the notebook
    is graded. Programs of this kernel are kept, even if the extension is loaded again.
    """
    known = front_end.active
    kernel = known if isinstance(known, Kernel) and known.shell is shell else Kernel(shell)
    for magic, text in (("node", _NODE_HELP), ("file", _FILE_HELP)):
        shell.register_magic_function(_writer(kernel, magic, text), magic_kind="cell", magic_name=magic)
    shell.register_magic_function(ros2_magic(kernel), magic_kind="line", magic_name="ros2")
    shell.register_magic_function(lab_magic(kernel), magic_kind="line", magic_name="lab")
    if kernel is known:
        return
    shell.input_transformers_cleanup.append(_with_body)
    front_end.active = kernel
    kernel.start()
    register_completion(shell, kernel)
    shell.events.register("pre_run_cell", kernel.begin_cell)
    shell.events.register("post_run_cell", kernel.end_cell)
    shell.display_formatter.mimebundle_formatter.for_type_by_name("autograder.checks.scoring", "Score", shown_score)
    for sentence in kernel.folder.kept:
        print(sentence)


def _with_body(lines: list[str]) -> list[str]:
    """Add an empty line to a cell that has only its first line, such as `%%file NAME`.

    Such a cell stands for an empty file, but IPython refuses a cell magic without a line below it.
    """
    alone = len(lines) == 1 and re.match(r"%%(node|file)\s+\S", lines[0])
    return [lines[0].rstrip("\n") + "\n", "\n"] if alone else lines


def shown_score(score: Score, **_: object) -> dict[str, str]:
    """Return the texts that a front end shows for a score."""
    from autograder.report.html import check_html
    from autograder.report.terminal import check_text

    # nbgrader takes the points from the plain text, and gives all points if that is not a number.
    graded = "NBGRADER_EXECUTION" in os.environ
    book = NO_BOOK if graded else _book()
    return {
        "text/plain": repr(score) if graded else check_text(score.result, score.remarks, score.origin, book),
        "text/html": check_html(
            score.result, remarks=score.remarks, origin=score.origin, on_demand=not graded, book=book
        ),
    }


def _book() -> Book:
    """Return the lectures of the student's course; if there is no course, hints have no links."""
    try:
        root = trusted_course(None) if is_students_kit() else course_root()
        # The book that lies beside the kit is not that of another course.
        return read_book(root, _address() if is_students_kit() or root == ROOT else "")
    except KitError:
        return NO_BOOK


def _address() -> str:
    """Return the address of the lectures as HTML, if there are any here.

    It is below the server's address, or a path in VS Code; elsewhere it is empty.
    """
    lectures = built_book()
    here = front_end.active
    notebook = here.folder.notebook if isinstance(here, Kernel) else None
    if lectures is None or notebook is None:
        return ""
    if "JPY_SESSION_NAME" not in os.environ:
        return os.path.relpath(lectures, notebook.parent)
    return os.environ.get("JUPYTERHUB_SERVICE_PREFIX", "/") + "lectures"


def _writer(kernel: Kernel, magic: str, text: str) -> Any:
    def write(line: str, cell: str) -> None:
        try:
            print("\n".join(_write(kernel, magic, line.strip(), cell)))
        except BadNameError as error:
            print(f"✗ not written: {error}")
        except OSError as error:
            print(f"✗ not written: {error.filename or 'the file'}: {error.strerror or error}. {_ANEW}")

    write.__doc__ = text
    return write


def _write(here: Kernel, magic: str, name: str, cell: str) -> list[str]:
    """Write a cell's file and return sentences for the student.

    Raises:
        BadNameError: the file cannot have this name.
        OSError: the file cannot be written.
    """
    check_name(magic, name)
    whole = here.cell.replace("\r\n", "\n")
    file = _parsed(whole)
    if file is None or (file.magic, file.name) != (magic, name):  # the magic was called by other code, not by a cell
        whole = "\n" * _lines_above(whole, cell) + f"%%{magic} {name}\n{cell}"
        file = parse(whole) or CellFile(magic, name, cell)
    check_free(file)
    if len(whole.encode("utf-8", "replace")) > CELL_BYTES:
        return [f"✗ not written: the cell is larger than {CELL_BYTES // 1024} KiB."]
    told = here.folder.write(Written(file, whole, here.cell_id, here.number, now()))
    kind = "node program" if magic == "node" else "file"
    where = f" ({shown(here.folder.path / file.file_name)})" if here.folder.notebook else ""
    defect = _defect(file)
    return [*told, f"{kind} {name} written{where}" + (f", but {defect}" if defect else "")]


def _lines_above(whole: str, cell: str) -> int:
    """Return the number of lines above the magic, such as `%%time`.

    It is needed because line numbers in the file are those of the whole cell.
    """
    body = cell.rstrip("\n")
    above = whole.rstrip("\n").removesuffix(body) if body else whole
    return max(above.count("\n") - 1, 0) if len(above) < len(whole) else 0


def _parsed(source: str) -> CellFile | None:
    try:
        return parse(source)
    except BadNameError:
        return None


def _defect(file: CellFile) -> str:
    """Say why the file cannot be read at all, with the line number in the cell; the text is empty if it can be read."""
    if file.magic == "node":
        try:
            compile(file.text, file.file_name, "exec", dont_inherit=True)
        except SyntaxError as error:
            text = (error.text or "").strip()
            where = f"line {error.lineno} of the cell" if error.lineno else "the cell"
            return f"{where} is not Python: {error.msg}" + (f"\n    {text}" if text else "")
        except (ValueError, RecursionError, MemoryError) as error:
            return f"it is not Python: {error}"
    elif file.name.endswith((".yaml", ".yml")):
        from autograder.core import student_yaml
        from autograder.reasons import Refused

        try:
            student_yaml.load(file.text)
        except Refused as error:
            return error.reason.because.removeprefix("the file, ").rstrip(".")
    elif file.name.endswith(".json"):
        import json  # line 1 of the cell is the magic, so one is added to line numbers below

        try:
            json.loads(file.text)
        except json.JSONDecodeError as error:
            return f"line {error.lineno + 1} of the cell is not JSON: {error.msg}"
        except (ValueError, RecursionError) as error:
            return f"it is not JSON: {error}"
    return ""
