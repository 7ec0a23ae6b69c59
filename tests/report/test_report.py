"""One result, four views: none of them shows a student what hidden tests look at, or lets a student's text act."""

from __future__ import annotations

import datetime
import io
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from typing import Any

import pytest
from junitparser import JUnitXml
from places import ROOT
from rich.console import Console

from autograder.core.grades import CellGrade, Grade
from autograder.core.results import CheckResult, Isolation, NodeLog, Outcome, Part, Status, SubmissionResult
from autograder.course.settings import NO_BOOK, read_book
from autograder.report.audience import Audience, result_for
from autograder.report.export.csv_table import to_csv
from autograder.report.export.entry import Entry
from autograder.report.export.gradescope import results_json
from autograder.report.export.junit import junit_xml
from autograder.report.feedback_page import Heading, Task, feedback_html
from autograder.report.html import check_html, hints
from autograder.report.terminal import check_text, check_view, class_view, submission_view, undecided_view

BOOK = read_book(ROOT)
NASTY = "<img src=x onerror=alert(1)>\x1b[31m\x00 `code` & [link](javascript:alert(2))"


def check(points: float | None, *outcomes: Outcome, grade_id: str = "check") -> CheckResult:
    return CheckResult(grade_id=grade_id, title="The talker", max_points=3, points=points, outcomes=list(outcomes))


def outcome(status: Status, **more: object) -> Outcome:
    return Outcome.model_validate({"status": status, "title": "a title", **more})


HIDDEN = outcome(
    Status.FAILED,
    title="secret-title", expected="secret-expected", observed="secret-observed", because="secret-because",
    code="secret-code", hint="See lecture 2.", hidden=True,
)  # fmt: skip
FAILED = outcome(Status.FAILED, expected=NASTY, observed=NASTY, because=NASTY, hint=NASTY, code="qos")


def result(*checks: CheckResult, student: str = "ann") -> SubmissionResult:
    log = NodeLog(program="talker", text=f"line 1\n{NASTY}\nlast line", exit_status=1)
    checks = (checks[0].model_copy(update={"logs": [log]}), *checks[1:]) if checks else ()
    return SubmissionResult(
        student=student, lab="lab", digest="d" * 64, isolation=Isolation.FULL, checks=list(checks),
        problems=[outcome(Status.FAILED, title=NASTY, because=NASTY, hint=NASTY, code="forged-cell")],
    )  # fmt: skip


def text_of(view: object, width: int = 120) -> str:
    console = Console(file=io.StringIO(), width=width, highlight=False)
    console.print(view)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


class Page(HTMLParser):
    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        self.text += data


@pytest.mark.parametrize("audience", ["student", "instructor"])
def test_every_view_masks_hidden_checks_for_students_only(audience: Audience) -> None:
    shown = result(check(0, HIDDEN))
    views = [
        check_html(shown.checks[0], audience),
        junit_xml([shown], audience),
        text_of(submission_view(shown, audience)),
        result_for(shown, audience).model_dump_json(),
    ]
    for view in views:
        assert "See lecture 2." in view
        assert ("secret" in view) == (audience == "instructor")
        assert ("A hidden check failed" in view) == (audience == "student")
    assert "secret" not in results_json(shown)


def test_html_lets_nothing_of_a_students_act() -> None:
    cells = (CellGrade("check", 0.0, 3.0, True, False), CellGrade("why", 1.0, 2.0, False, True, NASTY))
    heading, task = Heading("lab", NASTY, NASTY, NASTY), Task(NASTY, ["check", "why"], {"why": NASTY, "talker": NASTY})
    text = feedback_html(
        heading, [task], result(check(0, FAILED, HIDDEN)), Grade(NASTY, "lab", cells, 0.0), datetime.date(2026, 11, 22)
    )
    assert "secret" not in text
    page = Page(text)
    known = {"html", "head", "meta", "title", "body", "h1", "p", "b", "div", "span", "br", "code", "details", "summary"}
    known |= {"pre", "style", "main", "section", "h2", "ol", "li", "a", "table", "thead", "tbody", "tr", "th", "td"}
    known |= {"ul"}
    assert {tag for tag, _ in page.tags} <= known
    assert all(str(attributes.get("href", "#")).startswith("#") for _, attributes in page.tags)
    assert {name for _, attributes in page.tags for name in attributes} <= {
        "lang", "charset", "http-equiv", "content", "style", "role", "aria-label", "aria-labelledby", "name", "class",
        "id", "href", "scope", "colspan", "aria-hidden", "tabindex",
    }  # fmt: skip
    assert "onerror=alert(1)" in page.text and "last line" in page.text


VERDICTS = {
    "passed": check(3, outcome(Status.PASSED)),
    "holds so far": check(3, outcome(Status.PASSED)).model_copy(update={"more_at_grading": True}),
    "partly passed": check(1, FAILED),
    "failed": check(0, FAILED),
    "not attempted yet": check(0, FAILED).model_copy(update={"not_attempted": ["talker.py", "table.yaml"]}),
    "could not find out": check(None, outcome(Status.UNKNOWN)),
}


@pytest.mark.parametrize("word", VERDICTS)
def test_a_verdict_is_told_by_word_symbol_and_border(word: str) -> None:
    page = check_html(VERDICTS[word])
    assert Page(page).text.split("·")[0].split(maxsplit=1)[1].strip() == word
    assert word in text_of(check_view(VERDICTS[word])).splitlines()[0]
    looks = {re.search(r"border-left:([^;]+)", check_html(shown))[1] for shown in VERDICTS.values()}  # type: ignore[index]
    symbols = {Page(check_html(shown)).text.split()[0] for shown in VERDICTS.values()}
    assert len(looks) == 5 and len(symbols) == 6  # failed and partly passed have one border


def test_points_that_are_decided_at_grading_are_not_claimed() -> None:
    shown = VERDICTS["holds so far"]
    for view in (Page(check_html(shown)).text, text_of(check_view(shown))):
        assert "up to 3 points, decided when the lab is graded" in view and "3 of 3" not in view


def test_what_was_not_looked_at_is_a_count_and_never_source() -> None:
    left = [outcome(Status.NOT_CHECKED, title="expect_node('/talker')") for _ in range(4)]
    for view in (Page(check_html(check(0, FAILED, *left))).text, text_of(check_view(check(0, FAILED, *left)))):
        assert "expect_node" not in view
        assert "Because of this, 4 more expectations were not checked." in view


def test_the_finding_comes_first_and_what_holds_is_folded() -> None:
    shown = check(0, outcome(Status.PASSED, title="it holds"), outcome(Status.FAILED, title="it fails"))
    page = check_html(shown)
    assert page.index("it fails") < page.index("<details") < page.index("it holds")


def test_a_lost_part_stands_with_its_finding_and_held_parts_are_folded() -> None:
    parts = [Part(title="the name", max_points=1, points=1), Part(title="the rate", max_points=2, points=0)]
    outcomes = [
        outcome(Status.PASSED, part="the name"), outcome(Status.FAILED, title="too slow", part="the rate")
    ]  # fmt: skip
    shown = check(1, *outcomes).model_copy(update={"parts": parts})
    page, text = check_html(shown), text_of(check_view(shown))
    assert page.index("the rate") < page.index("too slow") < page.index("<details") < page.index("the name")
    assert "✗ the rate: 0 of 2 points" in text and "1 part and 1 expectation hold" in text
    assert "partly passed" in text and "1 of 3 points" in text


def test_a_reason_that_several_parts_have_is_told_once_and_none_of_them_is_left_out() -> None:
    parts = [Part(title=name, max_points=1, points=0) for name in ("left", "right", "rear")]
    whys = {"left": "They have one name.", "right": "They have one name.", "rear": "It is not there."}
    outcomes = [outcome(Status.FAILED, part=name, because=why, hint="Name them.") for name, why in whys.items()]
    page = check_html(check(0, *outcomes).model_copy(update={"parts": parts}))
    assert page.count("Name them.") == 1
    seen, folded = page.split("<details", 1)
    assert "left" in seen and "It is not there." in seen and "right" not in seen
    assert "1 more for reasons that are given above" in folded and "right · 0 of 1 point" in folded


def test_an_untouched_answer_is_named_and_is_no_failure() -> None:
    text = text_of(check_view(VERDICTS["not attempted yet"]))
    assert "The cells `%%node talker`, `%%file table.yaml` are still as you received them." in text
    assert "✗" not in text and "0 of 3 points" in text


def test_the_cells_that_programs_came_from_are_named() -> None:
    told: dict[str, Any] = {"remarks": ["`talker` was <changed>"], "origin": "`talker` from cell [7]"}
    assert "<changed>" in Page(check_html(VERDICTS["failed"], **told)).text
    text = check_text(VERDICTS["failed"], **told)
    assert "<changed>" in text and text.splitlines()[-1].strip() == "`talker` from cell [7]"


def test_output_is_shown_without_escapes_and_only_its_end() -> None:
    text = "".join(f"\x1b[32m[INFO]\x1b[0m line {number}\r\n" for number in range(500))
    log = NodeLog(program="talker", text=text + "10 %\r100 %\x1b]0;window\x07", exit_status=None)
    failed = check(0, outcome(Status.FAILED)).model_copy(update={"logs": [log]})
    for view in (check_html(failed), check_text(failed, [], "")):
        assert "[INFO] line 499" in view and "line 400" not in view and "lines above]" in view
        assert "\x1b" not in view and "window" not in view
        assert "100 %" in view and "10 %" not in view.replace("100 %", "")
    assert "Output" not in check_html(VERDICTS["passed"].model_copy(update={"logs": [log]}))


def test_the_report_has_the_colours_of_the_page_it_is_in() -> None:
    page = check_html(VERDICTS["failed"])
    assert "background:#ffffff" not in page
    for colour in re.findall(r"[; \"](?:color|background):([^;\"]+)", page):
        assert colour.startswith("var(--jp-") or colour in ("#d55e00", "inherit"), colour


def test_html_says_that_an_instructor_decides() -> None:
    assert "your instructor decides" in check_html(check(None, outcome(Status.UNKNOWN)))
    assert "0 of 3 points" in check_html(check(0, FAILED))


def test_the_terminal_takes_no_orders_from_a_student() -> None:
    text = text_of(submission_view(result(check(0, FAILED)), "student"))
    assert "\x1b" not in text and "\x00" not in text
    assert "0 of 3 points" in text and "because" in text and "last line" in text


def test_thirty_students_are_readable_at_120_columns() -> None:
    checks = [check(3, outcome(Status.PASSED), grade_id=f"c{number}") for number in range(9)]
    checks.append(check(0, outcome(Status.FAILED, because="It waits without end. " * 20), grade_id="c9"))
    class_ = [result(*checks, student=f"student_with_long_name_{number}") for number in range(30)]
    lines = text_of(class_view(class_, {}, 120)).rstrip().split("\n")
    rows = [line for line in lines if line.startswith("student_with")]
    assert len(rows) == 30 and max(map(len, lines)) <= 120
    assert all("27/30" in row and "✗ failed" in row and "It waits without end" in row for row in rows)


def test_on_a_narrow_terminal_the_reasons_stand_whole_below_the_table() -> None:
    why = "The subscription requests `reliable`, and the publisher offers only best effort, so nothing can arrive."
    checks = [check(0, outcome(Status.FAILED, because=why), grade_id="c0")]
    class_ = [result(*checks, student="ann"), result(check(3, outcome(Status.PASSED)), student="bob")]
    lines = text_of(class_view(class_, {"ann": "2 of 5 points"}, 80), 80).rstrip().split("\n")
    assert max(map(len, lines)) <= 80
    assert why in " ".join(" ".join(lines).split()) and [line[:3] for line in lines].count("bob") == 1


def test_the_class_table_tells_part_of_the_points_from_none() -> None:
    checks = [check(points, outcome(Status.FAILED), grade_id=f"c{points}") for points in (1, 0)]
    (row,) = [line for line in text_of(class_view([result(*checks)], {}, 120)).split("\n") if "ann" in line]
    assert "◑✗" in row


def test_undecided_checks_are_listed_for_the_instructor() -> None:
    decided = result(check(3, outcome(Status.PASSED)))
    undecided = result(check(None, outcome(Status.UNKNOWN, because="The observer died.")), student="bob")
    assert undecided_view([decided]) is None
    assert "bob: The talker: The observer died." in text_of(undecided_view([decided, undecided]))
    unread = [check(None, outcome(Status.UNKNOWN, because="It is no notebook."), grade_id=name) for name in "abc"]
    assert "eve: everything: It is no notebook." in text_of(undecided_view([result(*unread, student="eve")]))
    assert "?" in text_of(class_view([undecided], {}, 120))


def test_junit_counts_failures_and_errors() -> None:
    xml = JUnitXml.fromstring(
        junit_xml([result(check(3), check(0, FAILED), check(None, outcome(Status.UNKNOWN)))]).encode()
    )
    # One failure is the submission's own problem; a check without any outcome has passed nothing wrong.
    assert (xml.tests, xml.failures, xml.errors) == (4, 2, 1)


def test_csv_and_gradescope_leave_undecided_points_open() -> None:
    class_ = [result(check(None, outcome(Status.UNKNOWN, code="grader")))]
    entries = [Entry(one.student, one.lab, one) for one in class_]
    assert "ann,lab,check,,3,could not find out,grader" in to_csv(entries, "").content
    assert "score" not in json.loads(results_json(class_[0]))["tests"][0]


def test_what_contradicts_itself_is_shown_to_instructors_only() -> None:
    flagged = result(check(3, outcome(Status.PASSED)).model_copy(update={"flags": ["One thread only."]}))
    assert "One thread only." in text_of(submission_view(flagged, "instructor"))
    assert "One thread only." not in text_of(submission_view(flagged, "student"))
    assert "ann: One thread only." in text_of(undecided_view([flagged]))
    assert "ann and bob share a run." in text_of(undecided_view([], ["ann and bob share a run."]))


def test_what_to_repair_first_names_a_reason_once_with_every_task_that_it_costs() -> None:
    broken = outcome(Status.FAILED, because="The file is not a notebook.", hint="Open it.", code="not-json")
    other = outcome(Status.FAILED, because="Nothing was published.", code="silent")
    reasons = {"one": broken, "two": other, "three": broken.model_copy(update={"hint": "Another."})}
    told = result(*(check(0, why, grade_id=name) for name, why in reasons.items()))
    tasks = [Task(f"Task {name}", [name]) for name in reasons]
    cells = tuple(CellGrade(name, 0.0, 3.0, True, False) for name in reasons)
    text = feedback_html(
        Heading("lab", "ann"), tasks, told, Grade("ann", "lab", cells, 0.0), datetime.date(2026, 11, 22)
    )
    first = Page(text[text.index("What to repair first") : text.index("<section")]).text
    assert "Task one; Task three (6 points lost): The file is not a notebook." in first
    assert first.index("Task three") < first.index("Task two (3 points lost)")
    assert first.count("is not a notebook") == 1


def test_in_a_notebook_hints_open_one_after_the_other_and_lead_to_the_book() -> None:
    failed = Outcome(
        status=Status.FAILED, title="beats", because="The timer waits.", code="one-group",
        hint="Give them two groups; lecture 2, section 'How many threads?'. Then count threads.",
    )  # fmt: skip
    said = [hint.text for hint in hints(failed, BOOK)]
    assert said == ["Lecture 2, section 'How many threads?'.", "Give them two groups.", "Then count threads."]
    check = CheckResult(grade_id="c", title="c", max_points=1, points=0, outcomes=[failed])
    html = check_html(check, on_demand=True, book=replace(BOOK, address="../../lectures"))
    assert 'href="../../lectures/02_executors.html#how-many-threads"' in html
    inside = html[html.index("Hint (1 of 3)") :]
    assert inside.index("Another hint (2 of 3)") < inside.index("Give them") < inside.index("Another hint (3 of 3)")
    assert inside.index("Another hint (3 of 3)") < inside.index("</details>")  # in each other: no later one is in sight
    assert "<a" not in check_html(check, on_demand=True, book=BOOK)
    assert "<details" not in check_html(check) and "→ Give them" in Page(check_html(check)).text
    # A reason without a pointer of its own has the section that explains it.
    bare = failed.model_copy(update={"hint": ""})
    assert [hint.text for hint in hints(bare, BOOK)] == ["Lecture 2, section 'Second repair: a callback group'."]
    assert "Second repair" in check_text(check.model_copy(update={"outcomes": [bare]}), [], "", BOOK)
    # Of a course that says nothing of its lectures, nobody is sent to any.
    assert hints(bare, NO_BOOK) == []
    assert "Second repair" not in check_text(check.model_copy(update={"outcomes": [bare]}), [], "")
