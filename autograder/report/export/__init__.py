"""Results for other programs. A format is a module of this package and a line in `FORMATS`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from autograder.core.results import SubmissionResult
from autograder.report.export.csv_table import to_csv
from autograder.report.export.gradescope import to_gradescope
from autograder.report.export.junit import junit_xml

FORMATS: Mapping[str, Callable[[Sequence[SubmissionResult]], str]] = {
    "csv": to_csv,
    "junit": junit_xml,
    "gradescope": to_gradescope,
}
"""What writes a format, by the name that `autograder export` knows it by."""
