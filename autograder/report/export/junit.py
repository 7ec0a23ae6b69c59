"""The JUnit view, for CI: a suite for each submission, a case for each check."""

from __future__ import annotations

import re
from collections.abc import Sequence

from junitparser import Error, Failure, JUnitXml, TestCase, TestSuite

from autograder.core.results import CheckResult, Outcome, Status, SubmissionResult
from autograder.report.audience import Audience, reason, result_for

_NOT_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def junit_xml(results: Sequence[SubmissionResult], audience: Audience = "student") -> str:
    """Return JUnit XML: a check that failed is a failure, one that nobody could decide is an error."""
    xml = JUnitXml("autograder")
    for full in results:
        result = result_for(full, audience)
        suite = TestSuite(_xml(f"{result.lab}.{result.student}"))
        suite.add_property("isolation", result.isolation.value)
        suite.add_property("digest", result.digest)
        for problem in result.problems:
            case = TestCase(_xml(problem.title), _xml(f"{result.lab}.submission"))
            case.result = [_failed(Failure, [problem])]
            suite.add_testcase(case)
        for check in result.checks:
            suite.add_testcase(_case(check, result.lab))
        xml.add_testsuite(suite)
    xml.update_statistics()
    text: str = xml.tostring().decode("utf-8")
    return text


def _case(check: CheckResult, lab: str) -> TestCase:
    case = TestCase(_xml(check.title or check.grade_id), _xml(f"{lab}.{check.grade_id}"), round(check.seconds, 3))
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
    """Replace what XML cannot hold, such as the escape sequences in a program's output."""
    return _NOT_XML.sub("�", text)
