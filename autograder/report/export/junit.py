"""Export as JUnit XML for CI: a suite for each submission, and a case for each check and each answer graded by hand."""

from __future__ import annotations

import re
from collections.abc import Sequence

from junitparser import Error, Failure, JUnitXml, Skipped, TestCase, TestSuite

from autograder.core.grades import Grade
from autograder.core.results import CheckResult, Outcome, Status, SubmissionResult
from autograder.report.audience import Audience, reason, result_for
from autograder.report.export.entry import Entry, Export, points

_NOT_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def to_junit(entries: Sequence[Entry], _: str) -> Export:
    """Return JUnit XML of a class as students may see it, with the points that people gave."""
    return Export(_document([_suite(entry.result, "student", entry.grade) for entry in entries]))


def junit_xml(results: Sequence[SubmissionResult], audience: Audience = "student") -> str:
    """Return JUnit XML in which a failed check is a failure and an undecided check is an error."""
    return _document([_suite(result, audience, None) for result in results])


def _suite(full: SubmissionResult, audience: Audience, grade: Grade | None) -> TestSuite:
    result = result_for(full, audience)
    name = f"{result.lab}.{result.student}"
    suite = TestSuite(_xml(name))
    if grade is not None:
        suite.add_property("score", "" if grade.score is None else points(grade.score))
        suite.add_property("max_score", points(grade.max_score))
    suite.add_property("isolation", result.isolation.value)
    suite.add_property("digest", result.digest)
    for problem in result.real_problems:
        case = TestCase(_xml(problem.title), _xml(f"{name}.submission"))
        case.result = [_failed(Failure, [problem])]
        suite.add_testcase(case)
    for check in result.checks:
        suite.add_testcase(_case(check, name))
    checked = {check.grade_id for check in result.checks}
    for cell in grade.cells if grade is not None else ():
        if cell.grade_id not in checked:
            case = TestCase(_xml(cell.grade_id), _xml(f"{name}.{cell.grade_id}"))
            told = "not graded yet" if cell.points is None else f"{points(cell.points)} of {points(cell.max_points)}"
            case.result = [Skipped(told)]
            suite.add_testcase(case)
    return suite


def _document(suites: Sequence[TestSuite]) -> str:
    xml = JUnitXml("autograder")
    for suite in suites:
        xml.append(suite)  # add_testsuite compares each suite with all others
    xml.update_statistics()
    text: str = xml.tostring().decode("utf-8")
    return text


def _case(check: CheckResult, suite: str) -> TestCase:
    case = TestCase(_xml(check.title or check.grade_id), _xml(f"{suite}.{check.grade_id}"), round(check.seconds, 3))
    if check.status is Status.UNKNOWN:
        case.result = [_failed(Error, check.outcomes)]
    elif check.status is not Status.PASSED:
        case.result = [_failed(Failure, check.outcomes)]
    return case


def _failed(kind: type[Failure] | type[Error], outcomes: Sequence[Outcome]) -> Failure | Error:
    bad = [outcome for outcome in outcomes if outcome.status is not Status.PASSED]
    first = next((outcome for outcome in bad if outcome.status is not Status.NOT_CHECKED), None)
    entry = kind(_xml(reason(first)) if first else "not checked", _xml(first.code) if first else "")
    entry.text = _xml("\n\n".join(_text(outcome) for outcome in bad))
    return entry


def _text(outcome: Outcome) -> str:
    lines = [f"{outcome.status.value}: {outcome.title}"]
    pairs = ("expected", outcome.expected), ("observed", outcome.observed), ("because", outcome.because)
    lines += [f"  {label}: {text}" for label, text in (*pairs, ("try", outcome.hint)) if text]
    return "\n".join(lines)


def _xml(text: str) -> str:
    """Replace characters that XML cannot contain, such as those of escape sequences in a program's output."""
    return _NOT_XML.sub("�", text)
