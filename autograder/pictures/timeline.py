"""Draws timelines: when each callback ran on which thread, and when messages arrived."""

from __future__ import annotations

import itertools
import statistics
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from autograder.core.results import Picture
from autograder.pictures.svg import SMALL, TEXT, WIDTH, Canvas, seconds_axis, shortened, width_of


@dataclass(frozen=True)
class Run:
    """One run of a callback. Times are in seconds, from any common starting point."""

    callback: str
    begin: float
    end: float
    thread: int = 1
    """The threads of a program are numbered in the order in which they first ran a callback."""
    group: str = ""
    """The callback group in words, such as `default group, exclusive`."""
    node: str = ""
    ended: bool = True
    """Whether it had ended; False if it was still running when it was last seen."""
    period: float = 0.0
    """The period of the timer that it belongs to, in seconds; 0 if it does not belong to a timer."""


class Runs(Sequence[Run]):
    """The runs of the callbacks of one launch, in the order in which they began.

    Args:
        runs: the runs in any order.
    """

    def __init__(self, runs: Iterable[Run]) -> None:
        """Sort the runs."""
        self._runs = tuple(sorted(runs, key=lambda run: (run.begin, run.end, run.callback)))

    def __len__(self) -> int:
        return len(self._runs)

    def __getitem__(self, index: int) -> Run:  # type: ignore[override]
        return self._runs[index]

    def __iter__(self) -> Iterator[Run]:
        return iter(self._runs)

    def __repr__(self) -> str:
        counts = ", ".join(f"{name}: {self.count(name)}" for name in self.callbacks())
        return f"runs of callbacks: {counts or 'none'}"

    def callbacks(self) -> list[str]:
        """Return the names of the callbacks, in the order in which they first ran."""
        return list(dict.fromkeys(run.callback for run in self._runs))

    def of(self, *callbacks: str) -> Runs:
        """Return the runs of these callbacks, or of all callbacks if none is named."""
        return self._chosen(lambda run: not callbacks or run.callback in callbacks)

    def of_node(self, node: str) -> Runs:
        """Return the runs of the callbacks of the node with this full name."""
        return self._chosen(lambda run: run.node == node)

    def between(self, begin: float, end: float) -> Runs:
        """Return the runs that were active at some time between `begin` and `end`."""
        return self._chosen(lambda run: run.begin < end and run.end >= begin)

    def _chosen(self, wanted: Callable[[Run], bool]) -> Runs:
        return Runs(run for run in self._runs if wanted(run))

    def count(self, *callbacks: str) -> int:
        """Return how many runs of these callbacks began."""
        return len(self.of(*callbacks))

    def threads(self, *callbacks: str) -> set[int]:
        """Return the threads on which these callbacks ran."""
        return {run.thread for run in self.of(*callbacks)}

    def overlap(self, *callbacks: str) -> int:
        """Return the largest number of runs of these callbacks at the same time."""
        changes = sorted(change for run in self.of(*callbacks) for change in ((run.begin, 1), (run.end, -1)))
        return max(itertools.accumulate(change for _, change in changes), default=0)

    def longest_pause(self, callback: str) -> float:
        """Return the longest time between two successive begins of a callback, in seconds.

        It is infinite if there are fewer than two runs.
        """
        begins = [run.begin for run in self.of(callback)]
        return max((later - earlier for earlier, later in itertools.pairwise(begins)), default=float("inf"))

    def longest(self, callback: str) -> float:
        """Return the longest time that one run of a callback took, in seconds."""
        return max((run.end - run.begin for run in self.of(callback)), default=0.0)


_LANE = 30.0
"""The height of one row of bars."""
_HEAD = 26.0
"""The height of a heading above rows."""
_MOST_LABEL = 270.0
_MOST_LANES = 16
"""The number of rows of bars for one callback. If more runs overlap, the bars of the others cover each other."""
_MOST_RUNS = 600
"""The largest number of bars in one panel of a picture."""


@dataclass(frozen=True)
class _Row:
    """The bars of one label."""

    label: str
    below: str
    lanes: Sequence[Sequence[Run]]


def timeline(
    runs: Runs | Mapping[str, Runs], *, seconds: float | None = None, by: str = "callback", start: float | None = None
) -> Picture:
    """Draw when callbacks ran.

    Args:
        runs: the runs of one launch, or those of several launches by their titles. The launches get panels below each
            other with a common time axis.
        seconds: the time to draw; by default, all of it, but not more than 4 s.
        by: `callback` for a row for each callback below its group, or `thread` for a row for each thread.
        start: the time at which to begin, in the time of the runs; by default, each panel begins with its first run.

    Raises:
        ValueError: `by` is neither of the two.
    """
    if by not in ("callback", "thread"):
        raise ValueError(f"timeline: by={by!r} is neither 'callback' nor 'thread'.")
    panels = {"": runs} if isinstance(runs, Runs) else dict(runs)
    begins = {title: start if start is not None else min((r.begin for r in own), default=0.0)
              for title, own in panels.items()}  # fmt: skip
    lasted = max((run.end - begins[title] for title, own in panels.items() for run in own), default=0.0)
    length = seconds or min(4.0, max(lasted, 0.1))
    shown = {
        title: [_moved(run, begins[title]) for run in own.between(begins[title], begins[title] + length)][:_MOST_RUNS]
        for title, own in panels.items()
    }
    looks = {
        name: number for number, name in enumerate(dict.fromkeys(r.callback for own in shown.values() for r in own))
    }
    groups = {title: _sections(own, by) for title, own in shown.items()}
    labels = [row for sections in groups.values() for _, rows in sections for row in rows]
    left = 20 + min(
        _MOST_LABEL, max((max(width_of(r.label), width_of(r.below, SMALL)) for r in labels), default=60) + 10
    )
    height = 12 + 2 * TEXT + 14 + sum(_height(title, sections) for title, sections in groups.items())
    canvas = Canvas(height + (_LANE if by == "thread" else 0), WIDTH)
    y = 8.0
    for title, sections in groups.items():
        if title:
            canvas.words(8, y + TEXT, title, bold=True)
            y += _HEAD
        top = y
        bottom = top + sum(_section_height(heading, rows) for heading, rows in sections)
        last = title == list(groups)[-1]
        per_second = (
            seconds_axis(canvas, left, top, bottom, length) if last else _grid(canvas, left, top, bottom, length)
        )
        for heading, rows in sections:
            y = _draw_section(canvas, y, heading, rows, left, per_second, length, looks, by)
        if not sections:
            canvas.words(left + 8, y + TEXT, "no callback ran", italic=True)
            y += _LANE
        y += 8
    if by == "thread":
        _legend(canvas, height, looks)
    return canvas.picture(_alt(shown, length))


def _moved(run: Run, zero: float) -> Run:
    return replace(run, begin=run.begin - zero, end=run.end - zero)


def _sections(runs: Sequence[Run], by: str) -> list[tuple[str, list[_Row]]]:
    """Return the headings, each with the rows below it."""
    if by == "thread":
        threads = sorted({run.thread for run in runs})
        rows = [_Row(f"thread {number}", "", [[run for run in runs if run.thread == number]]) for number in threads]
        return [("", rows)] if rows else []
    nodes = {run.node for run in runs}
    sections: dict[str, list[_Row]] = {}
    for group in dict.fromkeys((run.node, run.group) for run in runs):
        heading = ": ".join(filter(None, (group[0] if len(nodes) > 1 else "", group[1])))
        members = [run for run in runs if (run.node, run.group) == group]
        for name in dict.fromkeys(run.callback for run in members):
            own = [run for run in members if run.callback == name]
            threads_used = sorted({run.thread for run in own})
            word = "thread" if len(threads_used) == 1 else "threads"
            sections.setdefault(heading, []).append(_Row(name, f"{word} {_listed(threads_used)}", _lanes(own)))
    return list(sections.items())


def _listed(numbers: Sequence[int]) -> str:
    if len(numbers) > 3 and numbers[-1] - numbers[0] == len(numbers) - 1:
        return f"{numbers[0]} to {numbers[-1]}"
    return ", ".join(map(str, numbers))


def _lanes(runs: Sequence[Run]) -> list[list[Run]]:
    """Distribute runs to lanes, so that runs that overlap are drawn below each other."""
    lanes: list[list[Run]] = []
    for run in runs:
        free = next((lane for lane in lanes if lane[-1].end <= run.begin), None)
        if free is not None:
            free.append(run)
        elif len(lanes) < _MOST_LANES:
            lanes.append([run])
        else:
            lanes[-1].append(run)
    return lanes


def _row_height(row: _Row) -> float:
    return max(len(row.lanes) * _LANE, 44.0 if row.below else 36.0) + 4


def _section_height(heading: str, rows: Sequence[_Row]) -> float:
    return (_HEAD if heading else 0) + sum(_row_height(row) for row in rows)


def _height(title: str, sections: Sequence[tuple[str, Sequence[_Row]]]) -> float:
    own = sum(_section_height(heading, rows) for heading, rows in sections) or _LANE
    return own + (_HEAD if title else 0) + 8


def _grid(canvas: Canvas, left: float, top: float, bottom: float, seconds: float) -> float:
    """Draw the grid without numbers, for panels above the last one, and return the units for one second."""
    per_second = (canvas.width - 24 - left) / seconds
    canvas.line([(left, top), (left, bottom), (canvas.width - 24, bottom)], line=1, grey=True)
    return per_second


def _draw_section(
    canvas: Canvas,
    y: float,
    heading: str,
    rows: Sequence[_Row],
    left: float,
    per_second: float,
    length: float,
    looks: Mapping[str, int],
    by: str,
) -> float:
    """Draw a heading and its rows from `y` downwards, and return where the next heading begins."""
    if heading:
        canvas.band(8, y + 2, canvas.width - 16, _HEAD - 4)
        canvas.words(14, y + TEXT, heading, size=SMALL, italic=True)
        y += _HEAD
    for row in rows:
        height = _row_height(row)
        middle = y + height / 2
        canvas.words(
            left - 10, middle + (0 if row.below else 0.35 * TEXT), shortened(row.label, left - 24), anchor="end"
        )
        if row.below:
            canvas.words(left - 10, middle + SMALL + 2, row.below, size=SMALL, anchor="end", fill="#444444")
        top = middle - len(row.lanes) * _LANE / 2
        for lane in row.lanes:
            for run in lane:
                _draw_run(canvas, run, left, top, per_second, length, looks[run.callback], by)
            top += _LANE
        y += height
    return y


def _draw_run(
    canvas: Canvas, run: Run, left: float, top: float, per_second: float, length: float, look: int, by: str
) -> None:
    begin, end = max(run.begin, 0.0), min(run.end, length)
    x, width = left + begin * per_second, max((end - begin) * per_second, 4.0)
    canvas.box(x, top + 3, width, _LANE - 6, look=look, dashed=not run.ended)
    if by == "callback" and width > 34:
        canvas.badge(x + width / 2, top + _LANE / 2, str(run.thread), SMALL - 1)


def _legend(canvas: Canvas, y: float, looks: Mapping[str, int]) -> None:
    x = 14.0
    for name, look in looks.items():
        canvas.box(x, y - 4, 26, 20, look=look)
        canvas.words(x + 32, y + 12, name, size=SMALL)
        x += 50 + width_of(name, SMALL)


def _alt(shown: Mapping[str, Sequence[Run]], length: float) -> str:
    told = []
    for title, runs in shown.items():
        own = Runs(runs)
        rows = []
        for name in own.callbacks():
            threads = sorted(own.threads(name))
            times = "once" if own.count(name) == 1 else f"{own.count(name)} times, each"
            rows.append(
                f"{name} ran {times} for at most {own.longest(name):.2f} seconds, on "
                f"{'thread' if len(threads) == 1 else 'threads'} {_listed(threads)}"
            )
        most = own.overlap()
        told.append(
            f"{title + ': ' if title else ''}{'; '.join(rows) or 'no callback ran'}"
            + (f"; at most {most} at once." if rows else ".")
        )
    return f"Timeline of {length:.1f} seconds. " + " ".join(told)


_TOPIC_ROW = 58.0


@dataclass(frozen=True)
class Traffic:
    """The messages of one end of a topic. Times are in seconds, from any common starting point."""

    who: str
    """The label of the end, such as `/camera publishes` or `/viewer takes`."""
    times: Sequence[float]
    since: float | None = None
    """When its node was created; None if that is not known."""


def arrivals(
    topic: str, traffic: Sequence[Traffic], *, seconds: float | None = None, start: float | None = None
) -> Picture:
    """Draw a row for each end of a topic, and a stroke for each message.

    Args:
        topic: the full name of the topic.
        traffic: the messages of the publishers first, then those of the subscriptions.
        seconds: the time to draw; by default, all of it.
        start: the time at which to begin, in the time of the messages; by default, the first event.
    """
    every = [time for row in traffic for time in (*row.times, *([row.since] if row.since is not None else []))]
    zero = min(every, default=0.0) if start is None else start
    length = seconds or max(max(every, default=0.0) - zero, 0.1) * 1.02
    left = 24 + min(280.0, max((width_of(row.who) for row in traffic), default=80.0) + 8)
    bottom = 42 + _TOPIC_ROW * max(1, len(traffic))
    canvas = Canvas(bottom + 2 * TEXT + 14, WIDTH)
    canvas.words(8, 26, topic, bold=True)
    per_second = seconds_axis(canvas, left, 40, bottom, length)
    for number, row in enumerate(traffic):
        y = 42 + number * _TOPIC_ROW
        canvas.words(left - 10, y + 26, shortened(row.who, left - 22), anchor="end")
        canvas.words(left - 10, y + 26 + SMALL + 3, _said(row), size=SMALL, anchor="end", fill="#444444")
        canvas.line([(left, y + 48), (WIDTH - 24, y + 48)], line=1)
        if row.since is not None and 0 <= row.since - zero <= length:
            x = left + (row.since - zero) * per_second
            canvas.line([(x, y + 6), (x, y + 52)], dashed=True)
            canvas.words(x + 5, y + 18, "starts", size=SMALL - 1)
        for time in row.times:
            if 0 <= time - zero <= length:
                x = left + (time - zero) * per_second
                canvas.line([(x, y + 22), (x, y + 48)], line=2.6)
    return canvas.picture(_arrivals_in_words(topic, traffic))


def _said(row: Traffic) -> str:
    return f"{len(row.times)} message{'s' * (len(row.times) != 1)}"


def _arrivals_in_words(topic: str, traffic: Sequence[Traffic]) -> str:
    told = [f"Messages of {topic}, a stroke for each."]
    for row in traffic:
        gaps = [later - earlier for earlier, later in zip(row.times, row.times[1:], strict=False)]
        rhythm = f", usually every {statistics.median(gaps):.2f} s, at most {max(gaps):.2f} s apart" if gaps else ""
        told.append(f"{row.who}: {_said(row)}{rhythm}.")
    return " ".join(told)
