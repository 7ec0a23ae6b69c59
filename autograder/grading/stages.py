"""The course's own stages in nbgrader's pipeline, and the configuration that puts them there.

nbgrader decides points by luck in too many ways: a cell without output earns them all, a warning on stderr costs them
all, and tests run in the process that runs the student's code. So nothing is executed here. The submission is rebuilt
from the released notebook and the text of the answers; the outputs of check cells come from the stored result; a check
without a result gets no automatic score.

Import it through `prepare_nbgrader` where start-up time matters.
"""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import Any

import nbformat
from jinja2.bccache import Bucket, BytecodeCache
from nbconvert.exporters import HTMLExporter, NotebookExporter
from nbconvert.filters import Highlight2HTML
from nbconvert.filters.widgetsdatatypefilter import WidgetsDataTypeFilter
from nbconvert.preprocessors import CSSHTMLHeaderPreprocessor
from nbconvert.preprocessors.sanitize import SanitizeHTML
from nbgrader import utils
from nbgrader.converters import Autograde
from nbgrader.preprocessors import (
    AssignLatePenalties,
    CheckCellMetadata,
    ClearMarkScheme,
    ClearOutput,
    ClearSolutions,
    ComputeChecksums,
    DeduplicateIds,
    GetGrades,
    LockCells,
    NbGraderPreprocessor,
    OverwriteCells,
    OverwriteKernelspec,
    SaveAutoGrades,
    SaveCells,
)

from autograder.errors import KitError
from autograder.grading.stage_a import Settings, result_path, run_submission, stored_result
from autograder.grading.stage_b import before_autograde
from autograder.report.html import check_html, render
from autograder.results import CheckResult, SubmissionResult
from autograder.submission.lab import CODE_STUB, TEXT_STUB, Lab, blank_mark, load_lab
from autograder.submission.markers import without_hidden_tests
from autograder.submission.reader import Submission, read_submission

_POINTS = "autograder_points"
"""Key under which a notebook's resources hold the points by grade_id."""


def _submitted(converter: Autograde, resources: dict[str, Any]) -> tuple[Path, str, Lab, Submission]:
    """Read the notebook that was handed in, whichever of nbgrader's two passes is running."""
    course = converter.coursedir
    student, name = resources["nbgrader"]["student"], resources["nbgrader"]["assignment"]
    lab = load_lab(Path(course.root), name)
    folder = Path(course.format_path(course.submitted_directory, student, name))
    return Path(course.root), student, lab, read_submission(folder / f"{name}.ipynb", lab)


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

    def from_filename(self, filename: str, resources: dict[str, Any] | None = None, **kwargs: Any) -> Any:
        """Rebuild the notebook in nbgrader's first pass; read what that pass wrote in the second."""
        if not self.parent._sanitizing:
            return super().from_filename(filename, resources=resources, **kwargs)
        resources = dict(resources or {})
        _, _, lab, submission = _submitted(self.parent, resources)
        resources["metadata"] = {"name": lab.name, "path": str(Path(filename).parent)}
        return self.from_notebook_node(nbformat.from_dict(submission.notebook), resources=resources, **kwargs)


class AttachResults(NbGraderPreprocessor):  # type: ignore[misc]
    """Puts the stored result into the outputs of the check cells, in place of execution.

    If there is none of these very answers, it runs the submission in the sandbox first.
    """

    def preprocess(self, nb: Any, resources: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
        """Attach outputs and note the points for `SaveCheckedGrades`."""
        root, student, lab, submission = _submitted(self.parent.parent, resources)
        path = result_path(root, lab.name, student)
        result = stored_result(path, submission.digest)
        if result is None:
            result = _run_now(root, student, lab, self.parent.parent.coursedir)
        checks = {check.grade_id: check for check in result.checks}
        points: dict[str, float | None] = {}
        for cell in nb.cells:
            if cell.cell_type == "code" and utils.is_grade(cell) and not utils.is_solution(cell):
                grade_id = cell.metadata.nbgrader["grade_id"]
                points[grade_id] = _attach(cell, checks.get(grade_id), result)
        if result.problems:
            # It quotes the student: no line of it may be the blank one that ends the HTML, and no word a link.
            note = inert_text(" ".join(render("problems.html", problems=result.problems).split()))
            nb.cells.insert(0, nbformat.v4.new_markdown_cell(note, id="problems"))
        resources[_POINTS] = points
        return nb, resources


def _run_now(root: Path, student: str, lab: Lab, course: Any) -> SubmissionResult:
    from autograder.results import Isolation
    from autograder.sandbox.isolation import choose

    settings = Settings(isolation=choose(Isolation.FULL))
    folder = Path(course.format_path(course.submitted_directory, student, lab.name))
    return run_submission(
        folder / f"{lab.name}.ipynb", student, lab, settings, keep_in=result_path(root, lab.name, student)
    )


def _attach(cell: Any, check: CheckResult | None, result: SubmissionResult) -> float | None:
    """Write a check's outputs into its cell and return its points; None: there is no verdict."""
    if check is not None and check.max_points != float(cell.metadata.nbgrader["points"]):
        check = None
    report = ""
    if check is not None:
        logs = [log for log in result.logs if log.grade_id == check.grade_id]
        report = check_html(check, audience="student", logs=logs)
    if check is None or check.points is None:
        # An error output: whoever grades by outputs alone must not take silence for success.
        cell.outputs = [nbformat.v4.new_output("error", ename="CouldNotFindOut", evalue="", traceback=[_UNDECIDED])]
        if report:
            cell.outputs.insert(0, nbformat.v4.new_output("display_data", {"text/html": report}))
        return None
    data = {"text/plain": f"{check.points:g}", "text/html": report}
    cell.outputs = [nbformat.v4.new_output("execute_result", data, execution_count=1)]
    return check.points


_UNDECIDED = "The grader could not find out. No points are taken: an instructor decides."


class SaveCheckedGrades(SaveAutoGrades):  # type: ignore[misc]
    """Records points of check cells from their results; without a verdict the cell waits for manual grading."""

    def _add_score(self, cell: Any, resources: dict[str, Any]) -> None:
        if utils.is_solution(cell) or cell.cell_type != "code":
            super()._add_score(cell, resources)
            return
        grade_id = cell.metadata["nbgrader"]["grade_id"]
        grade = self.gradebook.find_grade(grade_id, self.notebook_id, self.assignment_id, self.student_id)
        grade.auto_score = resources[_POINTS].get(grade_id)
        grade.needs_manual_grade = grade.auto_score is None or grade.manual_score is not None
        self.gradebook.db.commit()


class InertAnswers(NbGraderPreprocessor):  # type: ignore[misc]
    """Takes the life out of HTML in students' Markdown, which feedback and formgrader would put into their pages.

    A word joiner, which is invisible, parts every `<` from what would make it a tag. Unlike escaping it reads the same
    in text and in code.
    """

    def preprocess_cell(self, cell: Any, resources: dict[str, Any], index: int) -> tuple[Any, dict[str, Any]]:
        """Part the tags in an answer cell; the lab's own text stays as it is."""
        if cell.cell_type != "code" and utils.is_solution(cell):
            cell.source = inert(cell.source)
        return cell, resources


_BLANKS = 200
"""Longer rows of blanks in an answer are shortened to this many."""
_FORMULAS = 100
"""Formulas of LaTeX's longer spellings that are shown as such in an answer."""
_FORMULA = re.compile(r"(\\begin(?=\{)|\\\\(?=[\[(]))")
_FENCE = re.compile(r"^([ \t>*+\d.)-]*)(`{3,}|~{3,})[^`\n]*$", re.MULTILINE)


def inert(markdown: str) -> str:
    """Return Markdown in which nothing can become a tag, a script link or a picture from elsewhere."""
    return inert_text(re.sub(r"<(?=[A-Za-z/!?])", "<\u2060", markdown))


def inert_text(markdown: str) -> str:
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


class SanitizeOutputs(SanitizeHTML):  # type: ignore[misc]
    """nbconvert's sanitizer for what students wrote and for outputs; the lab's own text may hold code with `<`."""

    def preprocess_cell(self, cell: Any, resources: dict[str, Any], index: int) -> tuple[Any, dict[str, Any]]:
        """Sanitize outputs, which the kit wrote, once more; answers are inert already and are made so again."""
        if cell.cell_type != "code":
            if utils.is_solution(cell):
                cell.source = inert(cell.source)
            return cell, resources
        for output in cell.outputs:
            if output.output_type == "error":
                output.traceback = [_UNDECIDED]
        cell.outputs = self.sanitize_code_outputs(cell.outputs)
        return cell, resources


class HideTests(NbGraderPreprocessor):  # type: ignore[misc]
    """Keeps hidden tests out of what students receive, and says where they were."""

    def preprocess_cell(self, cell: Any, resources: dict[str, Any], index: int) -> tuple[Any, dict[str, Any]]:
        """Cut in the lab's own cells; a student who types a marker only types a word."""
        if not utils.is_solution(cell):
            cell.source = without_hidden_tests(cell.source)
        return cell, resources


class HideMarkScheme(ClearMarkScheme):  # type: ignore[misc]
    """Keeps mark schemes out of feedback."""

    def preprocess_cell(self, cell: Any, resources: dict[str, Any], index: int) -> tuple[Any, dict[str, Any]]:
        """Cut in the lab's own cells; a student who types a marker only types a word."""
        if utils.is_solution(cell):
            return cell, resources
        made: tuple[Any, dict[str, Any]] = super().preprocess_cell(cell, resources, index)
        return made


class StableNotebook(NbGraderPreprocessor):  # type: ignore[misc]
    """Leaves in a released notebook only what the lab's source decides, so that generating twice gives equal files."""

    def preprocess(self, nb: Any, resources: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
        """Name the cells by grade_id or number and drop what editors leave behind."""
        ids: set[str] = set()
        for number, cell in enumerate(nb.cells, start=1):
            grade_id = cell.metadata.get("nbgrader", {}).get("grade_id", "")
            name = re.sub(r"[^A-Za-z0-9_-]", "-", grade_id)[:60] or f"text-{number:02d}"
            cell["id"] = name if name not in ids else f"{name[:50]}-{number:02d}"
            ids.add(cell["id"])
            for key in ("collapsed", "scrolled", "ExecuteTime", "execution", "jupyter"):
                cell.metadata.pop(key, None)
            if cell.cell_type == "code":
                cell.outputs, cell.execution_count = [], None
                if utils.is_solution(cell):
                    cell.metadata["autograder"] = blank_mark(cell.source)
        kernel = {"display_name": "Python 3 (ipykernel)", "language": "python", "name": "python3"}
        nb.metadata = nbformat.from_dict({"kernelspec": kernel, "language_info": {"name": "python"}})
        nb.nbformat, nb.nbformat_minor = 4, 5
        return nb, resources


class _CompiledTemplates(BytecodeCache):
    """Keeps templates compiled from one feedback page to the next."""

    def __init__(self) -> None:
        self._codes: dict[str, bytes] = {}

    def load_bytecode(self, bucket: Bucket) -> None:
        if bucket.key in self._codes:
            bucket.bytecode_from_string(self._codes[bucket.key])

    def dump_bytecode(self, bucket: Bucket) -> None:
        self._codes[bucket.key] = bucket.bytecode_to_string()


_COMPILED = _CompiledTemplates()


_TOO_LONG_TO_COLOUR = re.compile(r"\s{200}|\S{400}")
"""No program looks like that, and the time that Pygments takes for it grows with the square of its length."""


class ColouredCode(Highlight2HTML):  # type: ignore[misc]
    """nbconvert's colouring of code, for what a person wrote; the rest is shown as plain text."""

    def __call__(self, source: str, language: str | None = None, metadata: Any = None) -> Any:
        """Return the HTML of a code cell."""
        return super().__call__(source, "text" if _TOO_LONG_TO_COLOUR.search(source) else language, metadata)


class FeedbackExporter(HTMLExporter):  # type: ignore[misc]
    """nbconvert's HTML in half the time, which is most of what a submission costs here.

    It compiles the templates once, and leaves out the second parsing of the page: that gives images without a
    description one, and nothing of a student's can become an image.
    """

    def _create_environment(self) -> Any:
        environment = super()._create_environment()
        environment.bytecode_cache = _COMPILED
        return environment

    def from_notebook_node(self, nb: Any, resources: dict[str, Any] | None = None, **kwargs: Any) -> Any:
        """Convert a notebook as HTMLExporter does before it parses its own page."""
        resources = self._init_resources(resources)
        self.register_filter("highlight_code", ColouredCode(pygments_lexer="ipython3", parent=self))
        self.register_filter(
            "filter_data_type",
            WidgetsDataTypeFilter(notebook_metadata=self._nb_metadata, parent=self, resources=resources),
        )
        return super(HTMLExporter, self).from_notebook_node(nb, resources, **kwargs)


SANITIZE = [ClearOutput, DeduplicateIds, OverwriteKernelspec, OverwriteCells, CheckCellMetadata]
"""What nbgrader does to the rebuilt notebook; among others it puts the check cells' full source back."""
AUTOGRADE = [AttachResults, SaveCheckedGrades, AssignLatePenalties, InertAnswers]
"""In place of nbgrader's execution."""
FEEDBACK = [GetGrades, HideTests, HideMarkScheme, SanitizeOutputs, CSSHTMLHeaderPreprocessor]
RELEASE = [
    LockCells,
    ClearSolutions,
    ClearOutput,
    CheckCellMetadata,
    ComputeChecksums,
    SaveCells,
    HideTests,
    ClearMarkScheme,
    ComputeChecksums,
    CheckCellMetadata,
    StableNotebook,
]

_REPORT_TAGS = ["div", "span", "b", "code", "pre", "details", "summary", "br", "p"]
_REPORT_STYLES = [
    "background",
    "border",
    "border-left",
    "color",
    "font-family",
    "font-size",
    "font-weight",
    "line-height",
    "margin",
    "margin-left",
    "margin-top",
    "max-height",
    "overflow-wrap",
    "overflow",
    "padding",
    "padding-left",
    "white-space",
]


def configure(config: Any, root: Path) -> None:
    """Write the course's layout and stages into an nbgrader configuration.

    Args:
        config: traitlets' Config, as `get_config()` gives it.
        root: of the course.
    """
    course = config.CourseDirectory
    course.root = str(root)
    course.source_directory = "solutions"
    course.release_directory = "labs"
    course.submitted_directory = "build/submitted"
    course.autograded_directory = "build/autograded"
    course.feedback_directory = "build/feedback"
    course.db_url = f"sqlite:///{root / 'build' / 'gradebook.db'}"
    # Of a submission only the notebook is taken. A file such as ipykernel_launcher.py, lying beside a notebook that an
    # instructor opens from formgrader, would be imported by that kernel.
    course.ignore = ["*"]
    config.Autograde.exporter_class = SubmissionExporter
    config.Autograde.sanitize_preprocessors = SANITIZE
    config.Autograde.autograde_preprocessors = AUTOGRADE
    config.Autograde.pre_convert_hook = partial(before_autograde, root)
    config.GenerateFeedback.exporter_class = FeedbackExporter
    config.GenerateFeedback.preprocessors = FEEDBACK
    config.GenerateAssignment.preprocessors = RELEASE
    config.Validator.failed_warning = "{num_failed} part(s) did not pass, or could not be checked:"
    config.ClearSolutions.code_stub = {"python": CODE_STUB}
    config.ClearSolutions.text_stub = TEXT_STUB
    config.SanitizeHTML.enabled = True
    config.SanitizeHTML.tags = _REPORT_TAGS
    config.SanitizeHTML.attributes = ["style", "role", "aria-label"]
    config.SanitizeHTML.styles = _REPORT_STYLES


def leave_gradebook_alone(config: Any) -> None:
    """Let labs be generated without a gradebook: making one takes longer than all the rest."""
    config.GenerateAssignment.no_database = True
    config.GenerateAssignment.preprocessors = [stage for stage in RELEASE if stage is not SaveCells]
