"""Export results for other programs. Each format has its function in this package and an entry in `FORMATS`."""

from __future__ import annotations

from collections.abc import Mapping

from autograder.report.export.blackboard import to_blackboard
from autograder.report.export.canvas import to_canvas, to_canvas_feedback
from autograder.report.export.csv_table import to_csv
from autograder.report.export.entry import Format
from autograder.report.export.gradescope import to_gradescope
from autograder.report.export.junit import to_junit
from autograder.report.export.moodle import to_moodle, to_moodle_feedback

FORMATS: Mapping[str, Format] = {
    "csv": to_csv,
    "junit": to_junit,
    "canvas": to_canvas,
    "canvas-feedback": to_canvas_feedback,
    "moodle": to_moodle,
    "moodle-feedback": to_moodle_feedback,
    "blackboard": to_blackboard,
    "gradescope": to_gradescope,
}
"""The function that makes each format, by the format's name in `autograder export`."""
SEVERAL_LABS = frozenset({"csv", "junit", "gradescope"})
"""The formats that can contain several labs."""
