"""The course's own stages of `nbgrader autograde`.

nbgrader decides points by luck in too many ways: a cell without output earns them all, a warning on stderr costs them
all, and tests run in the process that runs the student's code. So nothing is executed here. The submission is rebuilt
from the released notebook and the text of the answers; the outputs of check cells come from the stored result; a check
without a result gets no automatic score.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import nbformat
from nbconvert.exporters import NotebookExporter
from nbgrader import utils
from nbgrader.api import Gradebook
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
from autograder.gradebook.private_nbgrader import SaveScores, in_first_pass
from autograder.grading.runner import Settings, run_submission
from autograder.grading.store import ResultStore
from autograder.report.html import check_html, render
from autograder.sandbox.isolation import choose
from autograder.submission.reader import read_submission

UNDECIDED = "The grader could not decide this check. No points are lost, because an instructor decides."
"""What stands in the output of a check without a verdict."""


class HarmlessAnswers(NbGraderPreprocessor):  # type: ignore[misc]
    """Takes the life out of HTML in students' Markdown, which feedback and formgrader would put into their pages.

    A word joiner, which is invisible, parts every `<` from what would make it a tag. Unlike escaping it reads the same
    in text and in code.
    """

    def preprocess_cell(self, cell: Any, resources: dict[str, Any], index: int) -> tuple[Any, dict[str, Any]]:
        """Part the tags in an answer cell; the lab's own text stays as it is."""
        if cell.cell_type != "code" and utils.is_solution(cell):
            cell.source = harmless(cell.source)
        return cell, resources


_BLANKS = 200
"""Longer rows of blanks in an answer are shortened to this many."""
_FORMULAS = 100
"""Formulas of LaTeX's longer spellings that are shown as such in an answer."""
_FORMULA = re.compile(r"(\\begin(?=\{)|\\\\(?=[\[(]))")
_FENCE = re.compile(r"^([ \t>*+\d.)-]*+)(`{3,}+|~{3,}+)[^`\n]*+$", re.MULTILINE)  # what was taken is never given back


def harmless(markdown: str) -> str:
    """Return Markdown in which nothing can become a tag, a script link or a picture from elsewhere."""
    return harmless_text(re.sub(r"<(?=[A-Za-z/!?])", "<\u2060", markdown))


def harmless_text(markdown: str) -> str:
    """Return Markdown in which nothing but tags can become a script link, a drawing or a picture from elsewhere."""
    # nbconvert hands such a block to a drawing program in the browser, as it stands: it fetches pictures, too.
    markdown = markdown.replace("mermaid", "m\u2060ermaid")
    # For each of many blanks the Markdown reader looks at all that follow: 60000 take it a quarter of a minute.
    markdown = re.sub(f" {{{_BLANKS},}}", " " * _BLANKS, markdown)
    # So it does for the beginning of a formula that does not end: 20000 take it a quarter of a minute.
    *first, rest = _FORMULA.split(markdown, _FORMULAS)
    markdown = "".join(first) + _FORMULA.sub("\\1\u2060", rest)
    # Without the name of a language code is not coloured, which takes half a minute for 20000 lines of a blank.
    markdown = _FENCE.sub(r"\1\2", markdown)
    # What a browser fetches by itself would tell its owner who reads the page.
    parted = markdown.replace("![", "!\u2060[")
    # Only links that plainly begin with http stay links: there are too many ways to spell the other schemes.
    return re.sub(r"\](?=(\(|:)(?!\s*https?://))", "]\u2060", parted)


_POINTS = "autograder_points"
"""Key under which a notebook's resources hold the points by grade_id."""


def _submitted(converter: Autograde, resources: dict[str, Any]) -> tuple[Path, str, Lab, Path]:
    """Find the notebook that was handed in, whichever of nbgrader's two passes is running."""
    course = converter.coursedir
    student, name = resources["nbgrader"]["student"], resources["nbgrader"]["assignment"]
    lab = load_lab(Path(course.root), name)
    folder = Path(course.format_path(course.submitted_directory, student, name))
    return Path(course.root), student, lab, folder / f"{name}.ipynb"


class SubmissionExporter(NotebookExporter):  # type: ignore[misc]
    """Opens a submission for nbgrader as the released notebook with only the text of the answers in it.

    It stands before the sanitizing stages because nbgrader would give up on a file that is no notebook, and so that
    nothing else of a student's notebook, no tag, flag, output or extra cell, gets any further.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        """Refuse to take part in a pipeline with other stages than the course's."""
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
        """Rebuild the notebook in nbgrader's first pass; read what that pass wrote in the second."""
        if not in_first_pass(self.parent):
            return super().from_filename(filename, resources=resources, **kwargs)
        resources = dict(resources or {})
        _, _, lab, path = _submitted(self.parent, resources)
        submission = read_submission(path, lab)
        course, told = self.parent.coursedir, resources["nbgrader"]
        carry(path.parent, Path(course.format_path(course.autograded_directory, told["student"], lab.name)))
        resources["metadata"] = {"name": lab.name, "path": str(Path(filename).parent)}
        return self.from_notebook_node(nbformat.from_dict(submission.notebook), resources=resources, **kwargs)


class AttachResults(NbGraderPreprocessor):  # type: ignore[misc]
    """Puts the stored result into the outputs of the check cells, in place of execution.

    If there is none of these very answers, it runs the submission in the sandbox first.
    """

    def preprocess(self, nb: Any, resources: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
        """Attach outputs and note the points for `SaveCheckedGrades`."""
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
            # It quotes the student: no line of it may be the blank one that ends the HTML, and no word a link.
            note = harmless_text(" ".join(render("problems.html", problems=result.problems).split()))
            nb.cells.insert(0, nbformat.v4.new_markdown_cell(note, id="problems"))
        resources[_POINTS] = points
        return nb, resources


def _mark_scheme(cell: Any, lab: Lab) -> list[Any]:
    """What formgrader shows below an answer that a person grades: the course's own answer, with its mark scheme."""
    if not (utils.is_grade(cell) and utils.is_solution(cell)):
        return []
    answer = lab.answers[cell.metadata.nbgrader["grade_id"]]
    if answer.solution == answer.blank:  # of a course without its solutions
        return []
    text = f"**For whoever grades: the course's answer, which students do not see**\n\n{answer.solution}"
    return [nbformat.v4.new_markdown_cell(text, id=f"{cell.id[:50]}-scheme")]


def _attach(cell: Any, check: CheckResult | None) -> float | None:
    """Write a check's outputs into its cell and return its points; None: there is no verdict."""
    if check is not None and check.max_points != float(cell.metadata.nbgrader["points"]):
        check = None  # the gradebook knows the check with other points
    report = check_html(check, title=check.title) if check is not None else ""
    if check is None or check.points is None:
        # An error output: whoever grades by outputs alone must not take silence for success.
        cell.outputs = [nbformat.v4.new_output("error", ename="CouldNotFindOut", evalue="", traceback=[UNDECIDED])]
        if report:
            cell.outputs.insert(0, nbformat.v4.new_output("display_data", {"text/html": report}))
        return None
    data = {"text/plain": f"{check.points:g}", "text/html": report}
    cell.outputs = [nbformat.v4.new_output("execute_result", data, execution_count=1)]
    return check.points


class SaveCheckedGrades(SaveScores):
    """Records points of check cells from their results; without a verdict the cell waits for manual grading.

    What a person gave stays. If what it was given for has changed since, the person is asked to look at it again.
    """

    def preprocess(self, nb: Any, resources: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
        """Record all grades of a submission, and that they are recorded."""
        root, student, lab, _ = _submitted(self.parent.parent, resources)
        self._programs = [cell.source for cell in nb.cells if cell.cell_type == "code" and utils.is_solution(cell)]
        digest = own_tables.recordable(root, lab, student)
        with Gradebook(resources["nbgrader"]["db_url"]) as gradebook:
            own_tables.make_tables(gradebook.engine)
        made: tuple[Any, dict[str, Any]] = super().preprocess(nb, resources)
        with Gradebook(resources["nbgrader"]["db_url"]) as gradebook:
            own_tables.note_recorded(gradebook.db, lab.name, student, digest)
            gradebook.db.commit()
        return made

    def score_check(self, grade: Any, resources: dict[str, Any]) -> None:
        """Set the points that checking found."""
        grade.auto_score = resources[_POINTS].get(grade.name)

    def needs_person(self, grade: Any, cell: Any, asked: bool) -> bool:
        """Ask where there are no points yet, and where points were given by hand for something else."""
        programs = [] if utils.is_solution(cell) else self._programs
        about = own_tables.digest_of(cell.source, programs, grade.auto_score, grade.max_score)
        before = own_tables.judged(self.gradebook.db, grade.id)
        own_tables.note_judged(self.gradebook.db, grade.id, about)
        if grade.manual_score is None and grade.extra_credit is None:
            return grade.auto_score is None
        return asked or about != before


SANITIZE = [ClearOutput, DeduplicateIds, OverwriteKernelspec, OverwriteCells, CheckCellMetadata]
"""What nbgrader does to the rebuilt notebook; among others it puts the check cells' full source back."""
AUTOGRADE = [AttachResults, SaveCheckedGrades, AssignLatePenalties, HarmlessAnswers]
"""In place of nbgrader's execution."""
