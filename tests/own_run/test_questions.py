"""Questions about a student's own run: real runs of the solutions, and moments about which nothing may be asked."""

from __future__ import annotations

from itertools import pairwise

import pytest
import replay
import sample_class
from pydantic import ValidationError
from sample_class import recording_cell

from autograder.core.results import Isolation
from autograder.course.lab import load_lab
from autograder.grading.job import Job
from autograder.grading.own_runs import run_recorded
from autograder.own_run import questions, topic_questions
from autograder.own_run.keys import key
from autograder.own_run.question import Question
from autograder.own_run.questions import chosen
from autograder.own_run.record import Record, StateChange
from autograder.pictures import Run, Traffic

CHECKS = {
    "lab1_nodes": ("check_listener",),
    "lab2_executors": ("check_heartbeat", "check_mutex_reentrant", "check_two_mutex"),
    "lab3_remapping": ("check_names",),
    "lab4_lifecycle": ("check_sensor_second_life", "check_manager_up"),
    "lab6_actions": ("check_taxi",),
    "lab8_bringup": ("check_recovery",),
}


def recorded(lab_name: str) -> list[Record]:
    """What the solution of a lab does in some of its checks, and in the cell that records a student's own run."""
    lab = load_lab(sample_class.ROOT, lab_name)
    files = lab.files_with({name: answer.solution for name, answer in lab.answers.items()})
    job = Job(
        student="solution",
        lab=lab_name,
        digest="",
        isolation=Isolation.NONE,
        seed=3,
        files=files,
        cells=[*lab.cells, recording_cell(lab)],
    )
    wanted = [*CHECKS[lab_name], recording_cell(lab).grade_id]
    checks, records = run_recorded(job, wanted)
    assert [check.grade_id for check in checks] == wanted
    assert {record.recorded_by for record in records} == set(wanted)
    return records


@pytest.mark.parametrize("lab_name", CHECKS)
def test_of_real_runs_every_key_is_what_a_replay_of_the_run_shows(lab_name: str) -> None:
    records = recorded(lab_name)
    asked = [(record, question) for record in records for question in questions.possible(record)]
    assert len({question.kind for _, question in asked}) >= 2
    for record, question in asked:
        assert key(record, question) == replay.answer(record, question), question
        assert not question.choices or key(record, question) in question.choices, question
        assert len(set(question.choices)) == len(question.choices) != 1
    some = chosen(records, "any", 4)
    assert len(some) == 4
    assert some == chosen(records, "any", 4)
    assert any(chosen(records, str(seed), 4) != some for seed in range(20))  # of a short run two may be the same
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


def at_once(*counts: int) -> Record:
    """A record in which these numbers of callbacks are under way, one number after the other, on five threads."""
    runs = [
        Run(f"r{thread}", 0.4 * turn, 0.4 * turn + 0.3, 1 + (thread + turn) % 5, "reentrant group", "/robot")
        for turn, count in enumerate(counts)
        for thread in range(count)
    ]
    return Record(runs=tuple(runs))


def test_how_many_ran_at_once_is_asked_only_if_no_number_is_the_usual_one() -> None:
    assert not list(questions.under_way(at_once(4, 4, 1, 4, 4)))
    record = at_once(3, 4, 4, 4, 5, 4)
    numbers = [key(record, question) for question in questions.under_way(record)]
    assert set(numbers) == {"3", "4", "5"} and len({numbers.count(number) for number in numbers}) == 1


def test_which_callback_a_thread_ran_is_not_asked_about_the_first_runs() -> None:
    record = at_once(4, 4, 2)
    asked = list(questions.on_thread(record))
    assert {question.about["thread"] for question in asked} == {2, 3, 4, 5}
    assert all(0.4 < float(question.about["time"]) < 0.7 for question in asked)
    for question in asked:
        assert key(record, question) == replay.answer(record, question) in question.choices


def test_what_a_callback_waited_for_is_not_asked_if_its_group_has_only_one_other() -> None:
    slow = Run("slow", 0.12, 0.599, 1, GROUP, "/robot")
    elsewhere = Run("plan", 0.75, 0.8, 1, "exclusive group", "/robot")
    assert not list(questions.waited_for(Record(runs=(*BEATS, slow, elsewhere))))


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
    assert not list(topic_questions.sent_while_active(record)), "a message within 15 ms of the end of the active state"
    assert kinds(Record()) == set()


def test_transitions_are_not_counted_if_the_beginning_of_the_first_one_was_missed() -> None:
    way = ("unconfigured", "configuring", "inactive", "activating", "active", "deactivating", "inactive")
    changes = tuple(
        StateChange(node="/lidar", start=start, goal=goal, time=0.1 * number)
        for number, (start, goal) in enumerate(pairwise(way))
    )
    (question,) = questions.transitions(Record(changes=changes))
    assert key(Record(changes=changes), question) == replay.answer(Record(changes=changes), question) == "3"
    assert not list(questions.transitions(Record(changes=changes[1:])))


@pytest.mark.parametrize("first", (0.0, 0.01, 0.02, 0.03, 0.0466))
def test_messages_that_come_as_fast_as_the_windows_begin_can_be_asked_about(first: float) -> None:
    times = [round(first + 0.05 * number, 4) for number in range(50)]
    record = Record(traffic={"/data": (Traffic("/robot publishes", times),)})
    asked = list(topic_questions.sent_at_its_rate(record))
    assert asked and all(key(record, question) == replay.answer(record, question) for question in asked)


def test_a_record_with_times_that_no_launch_has_is_refused() -> None:
    for time in (float("nan"), float("inf"), -1.0):
        with pytest.raises(ValidationError):
            Record(runs=(Run("beat", time, 1.0),))


def test_no_question_is_asked_about_messages_that_the_picture_leaves_out() -> None:
    burst = (0.0, 0.3, 0.6, 0.9, 0.916, 1.2, 1.5, 1.8, 2.1, 2.4, 2.7)
    record = Record(traffic={"/beat": (Traffic("/robot publishes", burst),)})
    assert any(about_916_ms(question) for question in questions.possible(record))
    asked = [question for seed in range(30) for _, question in chosen([record], str(seed), 4)]
    assert asked and "messages are drawn" in asked[0].picture(record).svg
    assert not any(map(about_916_ms, asked))


def about_916_ms(question: Question) -> bool:
    """Whether a question is about a time that holds the one that the picture leaves out."""
    return float(question.about.get("begin", 0)) < 0.916 < float(question.about.get("end", 3))
