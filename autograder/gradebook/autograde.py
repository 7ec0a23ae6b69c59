"""The course's own stages of `nbgrader autograde`.

nbgrader's own stages can give wrong points in several ways: a cell without output earns all of its points, a warning on
stderr costs all of them, and tests run in the same process as the student's code. Therefore nothing is executed here.
The submission is rebuilt from the released notebook and the text of the answers. The outputs of check cells come from
the stored result, and a check without a result gets no automatic score.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import nbformat
from nbconvert.exporters import NotebookExporter
from nbgrader import utils
from nbgrader.converters import Autograde
from nbgrader.preprocessors import (
    AssignLatePenalties,
    CheckCellMetadata,
    ClearOutput,
    DeduplicateIds,
    NbGraderPreprocessor,
    OverwriteCells,
    OverwriteKernelspec,
)

from autograder.core.errors import KitError
from autograder.core.results import CheckResult, Isolation
from autograder.course.lab import Lab, load_lab
from autograder.gradebook import own_tables
from autograder.gradebook.exchange_files import carry, only_notebooks
from autograder.gradebook.history import note_graded
from autograder.gradebook.private_nbgrader import SaveScores, in_first_pass
from autograder.grading.runner import Settings, run_submission
from autograder.grading.store import ResultStore
from autograder.report.html import check_html, render
from autograder.sandbox.isolation import choose
from autograder.submission.reader import read_submission

UNDECIDED = "The grader could not decide this check. No points are lost, because an instructor decides."
"""The output of a check without a verdict."""


class HarmlessAnswers(NbGraderPreprocessor):  # type: ignore[misc]
    """Makes HTML in students' Markdown harmless, because feedback and formgrader would put it into their pages.

    An invisible word joiner separates every `<` from the character that would make it a tag. Unlike an escape sequence,
    it looks the same in text and in code.
    """

    def preprocess_cell(self, cell: Any, resources: dict[str, Any], index: int) -> tuple[Any, dict[str, Any]]:
        """Make the tags in an answer cell harmless. The lab's own text is not changed."""
        if cell.cell_type != "code" and utils.is_solution(cell):
            cell.source = harmless(cell.source)
        return cell, resources


_BLANKS = 200
"""The number of spaces to which longer sequences of spaces in an answer are shortened."""
_FORMULAS = 100
"""The number of formulas in an answer, in the longer notations of LaTeX, that are shown as formulas."""
_FORMULA = re.compile(r"(\\begin(?=\{)|\\\\(?=[\[(]))")
_FENCE = re.compile(r"^([ \t>*+\d.)-]*+)(`{3,}+|~{3,}+)[^`\n]*+$", re.MULTILINE)  # possessive: no backtracking


def harmless(markdown: str) -> str:
    """Return the Markdown in a form in which nothing can become a tag, a script link or an external picture."""
    return harmless_text(re.sub(r"<(?=[A-Za-z/!?])", "<\u2060", markdown))


def harmless_text(markdown: str) -> str:
    """Return the Markdown in a form in which only tags can become a script link, a drawing or an external picture."""
    # nbconvert passes a mermaid block unchanged to a drawing program in the browser, which also fetches pictures.
    markdown = markdown.replace("mermaid", "m\u2060ermaid")
    # For each space the Markdown parser reads all spaces that follow: 60000 spaces take it 15 seconds.
    markdown = re.sub(f" {{{_BLANKS},}}", " " * _BLANKS, markdown)
    # The same is true for the beginnings of formulas that have no end: 20000 of them take 15 seconds.
    *first, rest = _FORMULA.split(markdown, _FORMULAS)
    markdown = "".join(first) + _FORMULA.sub("\\1\u2060", rest)
    # Code without the name of a language is not coloured. Colouring takes half a minute for 20000 lines of one space.
    markdown = _FENCE.sub(r"\1\2", markdown)
    # If a browser fetches a picture by itself, the owner of the picture learns who reads the page.
    parted = markdown.replace("![", "!\u2060[")
    # Only links that clearly begin with http stay links, because other schemes can be written in too many ways.
    return re.sub(r"\](?=(\(|:)(?!\s*https?://))", "]\u2060", parted)


_POINTS = "autograder_points"
"""The key in a notebook's resources that holds the points by grade_id."""


def _submitted(converter: Autograde, resources: dict[str, Any]) -> tuple[Path, str, Lab, Path]:
    """Return the course's folder, the student, the lab, and the submitted notebook, in both of nbgrader's passes."""
    course = converter.coursedir
    student, name = resources["nbgrader"]["student"], resources["nbgrader"]["assignment"]
    lab = load_lab(Path(course.root), name)
    folder = Path(course.format_path(course.submitted_directory, student, name))
    return Path(course.root), student, lab, folder / f"{name}.ipynb"


class SubmissionExporter(NotebookExporter):  # type: ignore[misc]
    """Opens a submission for nbgrader as the released notebook with only the text of the answers in it.

    This happens before nbgrader's sanitizing stages for two reasons. nbgrader would stop at a file that is no notebook.
    And nothing else from a student's notebook, such as a tag, flag, output or extra cell, may reach the later stages.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        """Refuse to work in a pipeline with stages other than the course's.

        Raises:
            KitError: the pipeline of `nbgrader autograde` has other stages.
        """
        super().__init__(*args, **kwargs)
        if not isinstance(self.parent, Autograde):
            return
        stages = (list(self.parent.sanitize_preprocessors), list(self.parent.autograde_preprocessors))
        if stages != (SANITIZE, AUTOGRADE):
            raise KitError(
                "The stages of `nbgrader autograde` are not this course's; nothing was executed.",
                "Remove Autograde settings from the command line and from other nbgrader_config files.",
            )
        self.parent.coursedir = only_notebooks(self.parent.coursedir)

    def from_filename(self, filename: str, resources: dict[str, Any] | None = None, **kwargs: Any) -> Any:
        """Rebuild the notebook in nbgrader's first pass. In its second pass, read the file that the first one wrote."""
        if not in_first_pass(self.parent):
            return super().from_filename(filename, resources=resources, **kwargs)
        resources = dict(resources or {})
        _, _, lab, path = _submitted(self.parent, resources)
        submission = read_submission(path, lab)
        course, told = self.parent.coursedir, resources["nbgrader"]
        carry(path.parent, Path(course.format_path(course.autograded_directory, told["student"], lab.name)))
        resources["metadata"] = {"name": lab.name, "path": str(Path(filename).parent)}
        notebook = nbformat.from_dict(lab.clean_notebook(submission.sources))
        return self.from_notebook_node(notebook, resources=resources, **kwargs)


class AttachResults(NbGraderPreprocessor):  # type: ignore[misc]
    """Puts the stored result into the outputs of the check cells instead of executing them.

    If there is no stored result for exactly these answers, it first runs the submission in the sandbox.
    """

    def preprocess(self, nb: Any, resources: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
        """Attach the outputs, and store the points for `SaveCheckedGrades`."""
        root, student, lab, path = _submitted(self.parent.parent, resources)
        store = ResultStore(root)
        result = store.fitting(lab, student, read_submission(path, lab).digest)
        if result is None:
            result = run_submission(path, student, lab, Settings(isolation=choose(Isolation.FULL)), store)
        checks = {check.grade_id: check for check in result.checks}
        points: dict[str, float | None] = {}
        for cell in nb.cells:
            if cell.cell_type == "code" and utils.is_grade(cell) and not utils.is_solution(cell):
                grade_id = cell.metadata.nbgrader["grade_id"]
                points[grade_id] = _attach(cell, checks.get(grade_id))
        nb.cells = [shown for cell in nb.cells for shown in (cell, *_mark_scheme(cell, lab))]
        if result.problems:
            # The note quotes the student, so it must contain no blank line, which would end the HTML, and no link.
            note = harmless_text(" ".join(render("problems.html", problems=result.problems).split()))
            nb.cells.insert(0, nbformat.v4.new_markdown_cell(note, id="problems"))
        resources[_POINTS] = points
        return nb, resources


def _mark_scheme(cell: Any, lab: Lab) -> list[Any]:
    """Return a cell with the course's own answer and its mark scheme, for formgrader to show below a student's answer.

    The result is empty if the cell is not graded by a person, or if the course has no solution for it.
    """
    if not (utils.is_grade(cell) and utils.is_solution(cell)):
        return []
    answer = lab.answers[cell.metadata.nbgrader["grade_id"]]
    if answer.solution == answer.blank:  # the course was copied without its solutions
        return []
    text = f"**For whoever grades: the course's answer, which students do not see**\n\n{answer.solution}"
    return [nbformat.v4.new_markdown_cell(text, id=f"{cell.id[:50]}-scheme")]


def _attach(cell: Any, check: CheckResult | None) -> float | None:
    """Write a check's outputs into its cell and return its points; None if there is no verdict."""
    if check is not None and check.max_points != float(cell.metadata.nbgrader["points"]):
        check = None  # the gradebook has other points for this check
    report = check_html(check, title=check.title) if check is not None else ""
    if check is None or check.points is None:
        # An error output is needed, because a tool that grades by outputs alone would treat an empty one as success.
        cell.outputs = [nbformat.v4.new_output("error", ename="CouldNotFindOut", evalue="", traceback=[UNDECIDED])]
        if report:
            cell.outputs.insert(0, nbformat.v4.new_output("display_data", {"text/html": report}))
        return None
    data = {"text/plain": f"{check.points:g}", "text/html": report}
    cell.outputs = [nbformat.v4.new_output("execute_result", data, execution_count=1)]
    return check.points


class SaveCheckedGrades(SaveScores):
    """Records the points of check cells from their results. A cell without a verdict waits for manual grading.

    Points that a person gave are kept. If the work has changed since then, the person is asked to look at it again.
    """

    def before_cells(self, nb: Any, resources: dict[str, Any]) -> None:
        """Read what the points depend on, before any of them is recorded."""
        root, student, lab, _ = _submitted(self.parent.parent, resources)
        self._programs = [cell.source for cell in nb.cells if cell.cell_type == "code" and utils.is_solution(cell)]
        self._digest = own_tables.recordable(root, lab.name, lab.source_digest, student)
        own_tables.make_tables(self.gradebook.db.connection())

    def after_cells(self, resources: dict[str, Any]) -> None:
        """Record a digest of what was recorded, and the history."""
        _, student, lab, path = _submitted(self.parent.parent, resources)
        talks = self.gradebook.db
        own_tables.note_recorded(talks, lab.name, student, self._digest)
        talks.flush()
        note_graded(talks.connection(), lab, student, path)

    def score_check(self, grade: Any, resources: dict[str, Any]) -> None:
        """Set the points from the result of the check."""
        grade.auto_score = resources[_POINTS].get(grade.name)

    def needs_person(self, grade: Any, cell: Any, asked: bool) -> bool:
        """Return True if there are no points yet, or if points were given by hand and the work has changed since."""
        programs = [] if utils.is_solution(cell) else self._programs
        about = own_tables.digest_of(cell.source, programs, grade.auto_score, grade.max_score)
        before = own_tables.judged(self.gradebook.db, grade.id)
        own_tables.note_judged(self.gradebook.db, grade.id, about)
        if grade.manual_score is None and grade.extra_credit is None:
            return grade.auto_score is None
        return asked or about != before


SANITIZE = [ClearOutput, DeduplicateIds, OverwriteKernelspec, OverwriteCells, CheckCellMetadata]
"""nbgrader's stages for the rebuilt notebook. One of them restores the full source of the check cells."""
AUTOGRADE = [AttachResults, SaveCheckedGrades, AssignLatePenalties, HarmlessAnswers]
"""The stages that replace nbgrader's execution."""
