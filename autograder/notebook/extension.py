"""The IPython extension: `%load_ext autograder` brings the cell magics that write programs and files.

The programs lie in a folder of the notebook's own, `nodes/NAME OF THE NOTEBOOK`, where `launch` finds them.
"""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, Any

from autograder.core import front_end
from autograder.core.errors import KitError
from autograder.course.cells import CELL_BYTES, BadNameError, CellFile, check_free, check_name, parse
from autograder.course.paths import book_of_kit, course_root, is_students_kit, trusted_course
from autograder.course.settings import NO_BOOK, Book, read_book
from autograder.notebook.kernel import Kernel, now
from autograder.notebook.magics import lab_magic, register_completion, ros2_magic
from autograder.notebook.program_folder import Written, shown

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
    """Give an IPython shell the `%%node`, `%%file`, `%ros2` and `%lab` magics, and start each cell's findings afresh.

    Programs of an earlier kernel do not count: one whose cell has been renamed or deleted since would still pass here,
    and be missing when the notebook is graded. Those of this kernel stay, also when the extension is loaded again.
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
    """A cell that is nothing but `%%file NAME` is an empty file; IPython refuses a magic without a line below it."""
    alone = len(lines) == 1 and re.match(r"%%(node|file)\s+\S", lines[0])
    return [lines[0].rstrip("\n") + "\n", "\n"] if alone else lines


def shown_score(score: Score, **_: object) -> dict[str, str]:
    """Return what a front end shows for a score."""
    from autograder.report.html import check_html
    from autograder.report.terminal import check_text

    # nbgrader takes the points from the plain text, and all of them where that is no number.
    graded = "NBGRADER_EXECUTION" in os.environ
    book = NO_BOOK if graded else _book()
    return {
        "text/plain": repr(score) if graded else check_text(score.result, score.remarks, score.origin, book),
        "text/html": check_html(
            score.result, remarks=score.remarks, origin=score.origin, on_demand=not graded, book=book
        ),
    }


def _book() -> Book:
    """The lectures of the course that the student works in; without one, hints lead nowhere."""
    try:
        return read_book(trusted_course(None) if is_students_kit() else course_root(), _address())
    except KitError:
        return NO_BOOK


def _address() -> str:
    """Link to the lectures of a student's kit: below the server's address, in VS Code a path; elsewhere empty."""
    lectures = book_of_kit()
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
    """Write a cell's file and return what to tell the student.

    Raises:
        BadNameError: it cannot have this name.
        OSError: it cannot be written.
    """
    check_name(magic, name)
    whole = here.cell.replace("\r\n", "\n")
    file = _parsed(whole)
    if file is None or (file.magic, file.name) != (magic, name):  # called from other code, not by its own cell
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
    """How many lines stand above the magic, such as `%%time`: the file's lines have the numbers of the whole cell."""
    body = cell.rstrip("\n")
    above = whole.rstrip("\n").removesuffix(body) if body else whole
    return max(above.count("\n") - 1, 0) if len(above) < len(whole) else 0


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
        import json  # the magic above is line 1

        try:
            json.loads(file.text)
        except json.JSONDecodeError as error:
            return f"line {error.lineno + 1} of the cell is not JSON: {error.msg}"
        except (ValueError, RecursionError) as error:
            return f"it is not JSON: {error}"
    return ""
