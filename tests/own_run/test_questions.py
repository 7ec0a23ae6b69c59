"""Questions about a student's own run: real runs of the solutions, and moments about which nothing may be asked."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import pytest
import sample_class
from pydantic import ValidationError

from autograder.core.results import Isolation
from autograder.course.lab import load_lab
from autograder.grading.job import Job
from autograder.grading.own_runs import run_recorded
from autograder.own_run import questions
from autograder.own_run.keys import key
from autograder.own_run.question import Question
from autograder.own_run.questions import chosen
from autograder.own_run.record import Record, StateChange
from autograder.pictures import Run, Traffic

CHECKS = {
    "lab2_executors": ("check_heartbeat", "check_mutex_reentrant", "check_two_mutex"),
    "lab4_lifecycle": ("check_sensor_second_life", "check_manager_up"),
}


def recorded(lab_name: str) -> list[Record]:
    """What the solution of a lab does in some of its checks."""
    lab = load_lab(sample_class.ROOT, lab_name)
    files = lab.files_with({name: answer.solution for name, answer in lab.answers.items()})
    job = Job(
        student="solution",
        lab=lab_name,
        digest="",
        isolation=Isolation.NONE,
        seed=3,
        files=files,
        cells=list(lab.cells),
    )
    checks, records = run_recorded(job, CHECKS[lab_name])
    assert [check.grade_id for check in checks] == list(CHECKS[lab_name])
    assert {record.recorded_by for record in records} == set(CHECKS[lab_name])
    return records


@dataclass
class Moment:
    """What a replay of a record has seen up to some event."""

    time: float
    what: str
    """`begin`, `end` or `sent`."""
    run: Run | None = None
    topic: str = ""
    running: list[Run] = field(default_factory=list)
    """After this event."""


def replay(record: Record) -> Iterator[Moment]:
    """Go through a record event by event, as it happened, which `keys` never does."""
    events = [(run.begin, "begin", run, "") for run in record.runs] + [(run.end, "end", run, "") for run in record.runs]
    for topic, rows in record.traffic.items():
        events += [(t, "sent", None, topic) for row in rows if "publishes" in row.who for t in row.times]
    running: list[Run] = []
    for time, what, run, topic in sorted(events, key=lambda event: event[0]):
        if run is not None and what == "begin":
            running.append(run)
        elif run is not None and run in running:
            running.remove(run)
        yield Moment(time, what, run, topic, list(running))


def answer(record: Record, question: Question) -> str:
    """The answer to a question by replaying the record."""
    about, moments = question.about, list(replay(record))
    node, callback = about.get("node"), about.get("callback")
    of_node = [m for m in moments if m.run is not None and m.run.node == node]
    begins = [m for m in of_node if m.what == "begin"]
    if question.kind == "under_way":
        before = [m for m in moments if m.time <= about["time"]]
        return str(len([run for run in before[-1].running if run.node == node]))
    if question.kind == "waited_for":
        ended = [m for m in of_node if m.what == "end" and m.run.end - m.run.begin > 0.02]
        return min(ended, key=lambda m: abs(m.time - about["time"])).run.callback
    if question.kind == "began_during":
        return str(len([m for m in begins if m.run.callback == callback and about["begin"] < m.time < about["end"]]))
    if question.kind in ("longest_pause", "longest_silence"):
        times = [
            m.time
            for m in (begins if node else moments)
            if (m.run.callback == callback if node else m.topic == about["topic"])
        ]
        best = 0
        for number in range(1, len(times) - 1):
            if times[number + 1] - times[number] > times[best + 1] - times[best]:
                best = number
        return f"{times[best]:.2f} s" if node else str(best + 1)
    if question.kind == "thread_of":
        return str(next(m.run.thread for m in begins if m.run.callback == callback and m.time >= about["begin"]))
    if question.kind == "longest_transition":
        taken = {}
        for moment in moments:
            if moment.what == "end" and moment.run.callback.startswith("on_") and not moment.run.group:
                taken[moment.run.end - moment.run.begin] = f"{moment.run.callback} of {moment.run.node}"
        return taken[max(taken)]
    if question.kind == "transitions":
        began = ("configuring", "activating", "deactivating", "cleaningup", "shuttingdown")
        return str(len([change for change in record.changes if change.node == node and change.goal in began]))
    if question.kind == "transition_under_way":
        running = [m.running for m in moments if m.time <= about["time"]][-1]
        names = [f"{run.callback} of {run.node}" for run in running]
        return next((name for name in names if name in question.choices), "none of them")
    assert question.kind == "sent_between"
    return str(len([m for m in moments if m.topic == about["topic"] and about["begin"] < m.time < about["end"]]))


@pytest.mark.parametrize("lab_name", CHECKS)
def test_of_real_runs_every_key_is_what_a_replay_of_the_run_shows(lab_name: str) -> None:
    records = recorded(lab_name)
    asked = [(record, question) for record in records for kind in questions.KINDS for question in kind(record)]
    assert len({question.kind for _, question in asked}) >= 2
    for record, question in asked:
        assert key(record, question) == answer(record, question), question
        assert not question.choices or key(record, question) in question.choices, question
        assert len(set(question.choices)) == len(question.choices) != 1
    some = chosen(records, "any", 4)
    assert len(some) == 4
    assert some == chosen(records, "any", 4) != chosen(records, "another", 4)
    for record, question in some:
        assert question.picture(record).svg.startswith("<svg")


GROUP = "default group (exclusive)"
BEATS = tuple(Run("beat", begin, begin + 0.001, 1, GROUP, "/robot", period=0.1) for begin in (0.0, 0.1, 0.6, 0.7))


def kinds(record: Record) -> set[str]:
    """The kinds of questions that may be asked about a record."""
    return {question.kind for kind in questions.KINDS for question in kind(record)}


def test_a_late_callback_waited_for_the_one_that_ended_when_it_began() -> None:
    slow = Run("slow", 0.12, 0.599, 1, GROUP, "/robot")
    other = Run("plan", 0.75, 0.8, 1, GROUP, "/robot")
    (question,) = questions.waited_for(Record(runs=(*BEATS, slow, other)))
    assert "0.60 s" in question.text and question.choices == ("plan", "slow")
    assert key(Record(runs=(*BEATS, slow, other)), question) == "slow"
    in_another_group = Run("slow", 0.12, 0.599, 1, "exclusive group", "/robot")
    assert not list(questions.waited_for(Record(runs=(*BEATS, in_another_group, other))))


def test_nothing_is_asked_about_what_the_picture_cannot_show() -> None:
    during = Run("slow", 0.105, 0.55, 1, "exclusive group", "/robot")
    assert "began_during" not in {
        q.kind for q in questions.began_during(Record(runs=(*BEATS, during))) if q.about["callback"] == "beat"
    }
    times = [0.1, 0.2, 0.405, 0.5]
    record = Record(
        traffic={"/data": (Traffic("/robot publishes", times),)},
        changes=(
            StateChange(node="/robot", start="activating", goal="active", time=0.05),
            StateChange(node="/robot", start="active", goal="deactivating", time=0.4),
        ),
    )
    assert not list(questions.sent_while_active(record)), "a message within 15 ms of the end of the active state"
    assert kinds(Record()) == set()


def test_a_record_with_times_that_no_launch_has_is_refused() -> None:
    for time in (float("nan"), float("inf"), -1.0):
        with pytest.raises(ValidationError):
            Record(runs=(Run("beat", time, 1.0),))
