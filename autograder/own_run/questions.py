"""Finds questions about a record. Each function looks for moments of one kind that the picture shows beyond doubt.

A source text says what can happen; which of it happened, when and how often, only the record says. Therefore the
questions are about moments, numbers and orders of one run.
"""

from __future__ import annotations

import random
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from itertools import chain, pairwise

from autograder import pictures
from autograder.own_run import topic_questions
from autograder.own_run.moments import EDGE, SOME, countable
from autograder.own_run.question import Question
from autograder.own_run.record import SECONDS, Record
from autograder.pictures import Run, Runs

_LONG = 0.03
"""Seconds from which on a run of a callback is a bar in the picture and no stroke."""
_WITH_NUMBER = 0.17
"""Seconds from which on a bar has room for the number of its thread, in a picture of 3 s."""
NONE = "none of them"


def _whole(runs: Runs) -> Runs:
    """Return the runs that the record has from their beginning to their end."""
    return Runs(run for run in runs if run.ended and run.end < SECONDS)


def _long_callbacks(runs: Runs) -> list[str]:
    return [name for name in runs.callbacks() if runs.longest(name) >= _LONG]


def _place(run: Run) -> str:
    return f"from {run.begin:.2f} s to {run.end:.2f} s"


def under_way(record: Record) -> Iterator[Question]:
    """Ask how many callbacks ran at a moment, where the numbers vary so much that none is the usual one."""
    for node, runs in record.callbacks.items():
        moments = defaultdict(list)
        for time in _clear_moments(runs) if len(_long_callbacks(runs)) > 2 else ():
            moments[sum(run.begin < time < run.end for run in runs)].append(time)
        least = min(map(len, moments.values()), default=0)  # of each number, so that each is as often the answer
        for time in sorted(chain(*(times[:least] for times in moments.values()))) if len(moments) > SOME else ():
            yield Question(
                kind="under_way",
                about={"node": node, "time": time},
                text=f"How many runs of callbacks of `{node}` were under way at {time:.2f} s?",
                view="timeline",
                subject=node,
            )


def on_thread(record: Record) -> Iterator[Question]:
    """Ask which callback a thread ran at a moment, if each bar at this moment shows the number of its thread."""
    for node, runs in record.callbacks.items():
        first = [runs.of(name)[0] for name in runs.callbacks()]
        for time in _clear_moments(runs) if len(runs.threads()) > 2 else ():
            at_once = [run for run in runs if run.begin < time < run.end]
            if len(at_once) <= SOME or any(run.end - run.begin < _WITH_NUMBER for run in at_once):
                continue
            if any(run in first for run in at_once):
                continue  # the first runs are on threads 1, 2, 3 and so on
            for run in at_once:
                yield Question(
                    kind="on_thread",
                    about={"node": node, "thread": run.thread, "time": time},
                    text=f"Which callback of `{node}` did thread {run.thread} run at {time:.2f} s?",
                    choices=tuple(sorted(runs.callbacks())),
                    view="timeline",
                    subject=node,
                )


def _clear_moments(runs: Runs) -> Iterator[float]:
    """Yield moments at which callbacks were under way, and it is beyond doubt which ones."""
    last = max((run.end for run in _whole(runs)), default=0.0)
    for hundredth in range(5, int(100 * last), 7):
        time = hundredth / 100
        near = [run for run in runs if run.begin - EDGE < time < run.end + EDGE]
        if near and all(abs(edge - time) >= EDGE for run in near for edge in (run.begin, run.end)):
            yield time


def transition_under_way(record: Record) -> Iterator[Question]:
    """Ask which callback of a transition of several nodes ran at a moment."""
    runs = _transitions(record)
    long = Runs(run for run in runs if run.end - run.begin >= _LONG)
    names = sorted({f"{run.callback} of {run.node}" for run in long})
    for time in _moments(long) if len(names) > 3 else ():
        yield Question(
            kind="transition_under_way",
            about={"time": time},
            text=f"Which callback of a lifecycle transition was under way at {time:.2f} s?",
            choices=(*names, NONE),
            view="timeline",
            subject="",
        )


def _transitions(record: Record) -> Runs:
    return Runs(run for run in record.runs if run.callback.startswith("on_") and run.group == "")


def _moments(runs: Runs) -> Iterator[float]:
    """Yield moments at which it is beyond doubt which of these runs was under way, and that it was at most one."""
    last = max((run.end for run in _whole(runs)), default=0.0)
    for hundredth in range(5, int(100 * last), 7):
        time = hundredth / 100
        near = [run for run in runs if run.begin - EDGE < time < run.end + EDGE]
        if not near and hundredth % 5:
            continue  # otherwise most answers would be that none was
        if len(near) < 2 and all(abs(edge - time) >= EDGE for run in near for edge in (run.begin, run.end)):
            yield time


def waited_for(record: Record) -> Iterator[Question]:
    """Ask for which other callback a timer's callback had to wait that began late."""
    for node, runs in record.callbacks.items():
        for name in runs.callbacks():
            group = runs.of(name)[0].group
            if len({run.callback for run in runs if run.group == group}) <= SOME:
                continue  # the source tells which other one is in the group
            for one, two in pairwise(runs.of(name)):
                late = two.begin - one.begin - one.period
                held = [run for run in _whole(runs) if run.callback != name and run.end - run.begin >= _LONG]
                held = [run for run in held if abs(two.begin - run.end) < EDGE and run.begin < two.begin - late / 2]
                same = [run for run in held if run.group == group and "exclusive" in group]
                if one.period == 0 or late < max(0.4 * one.period, _LONG) or len(held) != 1 or len(same) != 1:
                    continue
                if any(held[0].end < run.end <= two.begin and run.group == group for run in runs):
                    continue  # a short one ran between, so two answers are right
                yield Question(
                    kind="waited_for",
                    about={"node": node, "callback": name, "time": two.begin},
                    text=f"`{name}` of `{node}` began late at {two.begin:.2f} s."
                    " The end of which callback did it wait for?",
                    choices=tuple(sorted(set(runs.callbacks()) - {name})),
                    view="timeline",
                    subject=node,
                )


def began_during(record: Record) -> Iterator[Question]:
    """Ask how often a callback began during one run of another one."""
    for node, runs in record.callbacks.items():
        for during in _whole(runs):
            if during.end - during.begin < 2 * _LONG:
                continue
            for name in runs.callbacks():
                begins = [run.begin for run in runs.of(name)]
                inside = [begin for begin in begins if during.begin < begin < during.end]
                near = any(abs(begin - edge) < EDGE for begin in begins for edge in (during.begin, during.end))
                if name == during.callback or near or len(inside) < SOME or not countable(inside):
                    continue
                yield Question(
                    kind="began_during",
                    about={"node": node, "callback": name, "begin": during.begin, "end": during.end},
                    text=f"`{during.callback}` of `{node}` ran {_place(during)}."
                    f" How many runs of `{name}` began in this time?",
                    view="timeline",
                    subject=node,
                )


def longest_pause(record: Record) -> Iterator[Question]:
    """Ask after which run of a callback the longest pause came."""
    for node, runs in record.callbacks.items():
        for name in runs.callbacks():
            begins = [run.begin for run in runs.of(name)]
            pauses = sorted(((two - one), one) for one, two in pairwise(begins))
            if (
                len(begins) < 4
                or pauses[-1][1] == begins[0]  # while the program starts, which can be told without the run
                or not countable(begins)
                or pauses[-1][0] < max(1.15 * pauses[-2][0], pauses[-2][0] + EDGE)
            ):
                continue
            # The others are spread over the record, so that the place of the right one says nothing.
            step = max(1, (len(begins) - 1) // 4)
            shown = sorted({pauses[-1][1], *begins[:-1:step][:4]})
            yield Question(
                kind="longest_pause",
                about={"node": node, "callback": name},
                text=f"After which run of `{name}` of `{node}` was the time until its next run the longest?"
                " Give the time at which that run began.",
                choices=tuple(f"{begin:.2f} s" for begin in shown),
                view="timeline",
                subject=node,
            )


def thread_of(record: Record) -> Iterator[Question]:
    """Ask on which thread one run was, if its bar is long enough for the thread's number.

    Threads have their numbers from their first runs, so that the thread of such a run can be known without the picture.
    """
    for node, runs in record.callbacks.items():
        threads = sorted(runs.threads())
        first = {thread: next(run for run in runs if run.thread == thread) for thread in threads}
        for run in _whole(runs) if len(threads) > 2 else ():
            if run.end - run.begin >= _WITH_NUMBER and run != first[run.thread]:
                yield Question(
                    kind="thread_of",
                    about={"node": node, "callback": run.callback, "begin": run.begin},
                    text=f"On which thread was the run of `{run.callback}` of `{node}` {_place(run)}?",
                    choices=tuple(map(str, threads)),
                    view="timeline",
                    subject=node,
                )


def longest_transition(record: Record) -> Iterator[Question]:
    """Ask which callback of a transition took the longest."""
    runs = _transitions(record)
    names = sorted({f"{run.callback} of {run.node}" for run in runs})
    long = sorted(run.end - run.begin for run in runs)
    cut = len(_whole(runs)) < len(runs)  # the picture does not show how long the last one took
    if len(names) > 3 and not cut and long[-1] > max(1.5 * long[-2], long[-2] + EDGE):
        yield Question(
            kind="longest_transition",
            about={},
            text="Which callback of a lifecycle transition took the longest?",
            choices=tuple(names),
            view="timeline",
            subject="",
        )


def transitions(record: Record) -> Iterator[Question]:
    """Ask through how many transitions a lifecycle node went, if the record has the beginning of each of them."""
    for node in sorted({change.node for change in record.changes}):
        way = pictures.steps(record.steps(node))
        if len(way) > SOME and all(step.label for step in way):
            yield Question(
                kind="transitions",
                about={"node": node},
                text=f"Through how many transitions did `{node}` go in this run, with those that failed?",
                view="lifecycle",
                subject=node,
            )


KINDS: tuple[Callable[[Record], Iterator[Question]], ...] = (
    under_way, on_thread, transition_under_way, waited_for, began_during, longest_pause, thread_of,
    longest_transition, transitions, *topic_questions.KINDS,
)  # fmt: skip
LAST_KINDS = (topic_questions.sent_at_its_rate,)
"""What is asked only if the other kinds do not find enough."""


def possible(record: Record) -> Iterator[Question]:
    """Yield every question that can be asked about a record."""
    for kind in (*KINDS, *LAST_KINDS):
        yield from kind(record)


def chosen(records: Sequence[Record], seed: str, number: int) -> list[tuple[Record, Question]]:
    """Choose questions at random, as far as possible each of another kind and about another node or topic.

    Args:
        records: of one submission.
        seed: with the same seed and records, the questions are the same.
        number: how many questions are wanted. There are fewer if the records do not have enough moments to ask about.
    """
    draw = random.Random(seed)
    kinds = draw.sample(KINDS, len(KINDS))
    found: list[tuple[Record, Question]] = []
    # Another one of a kind is asked only if there are not enough kinds.
    for kind in [*kinds * number, *LAST_KINDS * number]:
        if len(found) == number:
            break
        found_by = ((record, question) for record in records for question in kind(record))
        pairs = [(record, question) for record, question in found_by if question.is_drawn(record)]
        so_far = [(record, question.subject) for record, question in found]
        fresh = [(record, question) for record, question in pairs if (record, question.subject) not in so_far]
        texts = [question.text for _, question in found]
        pairs = [pair for pair in fresh or pairs if pair[1].text not in texts]
        if pairs:
            found.append(draw.choice(pairs))
    return found
