"""Draws timelines: when each callback ran on which thread."""

from __future__ import annotations

import itertools
from collections import Counter
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
    program: str = ""
    """The program in which it ran. Each program numbers its own threads."""
    period: float = 0.0
    """The period of the timer that it belongs to, in seconds; 0 if it does not belong to a timer."""
    known: bool = True
    """Whether its callback can be told from others: by its function, by what it belongs to, or by its line."""


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
_GAP = 6.0
"""The space above the heading of a node."""
_MOST_LABEL = 270.0
_MOST_LANES = 16
"""The number of rows of bars for one callback. If more runs overlap, the bars of the others cover each other."""
_MOST_RUNS = 600
"""The largest number of bars in one panel of a picture."""


_Callback = tuple[str, str]
"""A node and the name of one of its callbacks."""


@dataclass(frozen=True)
class _Row:
    """The bars of one label."""

    label: str
    below: str
    lanes: Sequence[Sequence[Run]]


@dataclass(frozen=True)
class _Section:
    """Rows below a heading: a node or program, which is said once, and a callback group of it."""

    owner: str
    group: str
    rows: Sequence[_Row]


@dataclass(frozen=True)
class _Scale:
    """How the bars are drawn."""

    left: float
    per_second: float
    length: float
    looks: Mapping[_Callback, int]
    by: str


def timeline(
    runs: Runs | Mapping[str, Runs], *, seconds: float | None = None, by: str = "callback", start: float | None = None
) -> Picture:
    """Draw when callbacks ran.

    Args:
        runs: the runs of one launch, or those of several launches by their titles. The launches get panels below each
            other with a common time axis.
        seconds: the time to draw; by default, all of it, but not more than 4 s.
        by: `callback` for a row for each callback below its node and group, or `thread` for a row for each thread.
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
        one: number for number, one in enumerate(dict.fromkeys(_callback(r) for own in shown.values() for r in own))
    }
    sections = {title: _sections(own, by) for title, own in shown.items()}
    labels = [row for own in sections.values() for section in own for row in section.rows]
    left = 20 + min(
        _MOST_LABEL, max((max(width_of(r.label), width_of(r.below, SMALL)) for r in labels), default=60) + 10
    )
    height = 12 + 2 * TEXT + 14 + sum(_height(title, own) for title, own in sections.items())
    keys = _keys(shown, looks if by == "thread" else {}, _least(left, length))
    lines = _key_lines(keys)
    canvas = Canvas(height + max(4, (len(lines) - 1) * _KEY_LINE), WIDTH)
    y = 8.0
    for title, own in sections.items():
        if title:
            canvas.words(8, y + TEXT, title, bold=True)
            y += _HEAD
        bottom = y + sum(map(_section_height, own))
        draw_grid = seconds_axis if title == list(sections)[-1] else _grid
        scale = _Scale(left, draw_grid(canvas, left, y, bottom, length), length, looks, by)
        for section in own:
            y = _draw_section(canvas, y, section, scale)
        if not own:
            canvas.words(left + 8, y + TEXT, "no callback ran", italic=True)
            y += _LANE
        y += 8
    _draw_key(canvas, height - 36, lines)  # its first line stands beside the word "seconds"
    return canvas.picture(_alt(shown, length))


def _callback(run: Run) -> _Callback:
    return (run.node, run.callback)


def _moved(run: Run, zero: float) -> Run:
    return replace(run, begin=run.begin - zero, end=run.end - zero)


def _sections(runs: Sequence[Run], by: str) -> list[_Section]:
    """Return the headings, each with the rows below it. What belongs to one node stands together."""
    if by == "thread":
        return _threads(runs)
    nodes = dict.fromkeys(run.node for run in runs)
    sections = []
    for node in sorted(nodes, key=lambda node: not node):  # what is of no known node comes last
        owner = (f"node {node}" if node else "node not known") if len(nodes) > 1 else ""
        for group in dict.fromkeys(run.group for run in runs if run.node == node):
            members = [run for run in runs if (run.node, run.group) == (node, group)]
            rows = []
            for name in dict.fromkeys(run.callback for run in members):
                own = [run for run in members if run.callback == name]
                rows.append(_Row(name, _on_threads(own), _lanes(own)))
            sections.append(_Section(owner, group, rows))
            owner = ""
    return sections


def _threads(runs: Sequence[Run]) -> list[_Section]:
    """Return a row for each thread, below the program that it belongs to."""
    programs = dict.fromkeys(run.program for run in runs)
    sections = []
    for program in programs:
        own = [run for run in runs if run.program == program]
        rows = [
            _Row(f"thread {number}", "", [[run for run in own if run.thread == number]])
            for number in sorted({run.thread for run in own})
        ]
        sections.append(_Section(f"program {program}" if len(programs) > 1 else "", "", rows))
    return sections


def _on_threads(runs: Sequence[Run]) -> str:
    """Return in words on which threads these runs were."""
    threads = sorted({run.thread for run in runs})
    return f"{'thread' if len(threads) == 1 else 'threads'} {_listed(threads)}"


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


def _section_height(section: _Section) -> float:
    headings = _HEAD * bool(section.group) + (_HEAD + _GAP) * bool(section.owner)
    return headings + sum(map(_row_height, section.rows))


def _height(title: str, sections: Sequence[_Section]) -> float:
    own = sum(map(_section_height, sections)) or _LANE
    return own + (_HEAD if title else 0) + 8


def _grid(canvas: Canvas, left: float, top: float, bottom: float, seconds: float) -> float:
    """Draw the grid without numbers, for panels above the last one, and return the units for one second."""
    per_second = (canvas.width - 24 - left) / seconds
    canvas.line([(left, top), (left, bottom), (canvas.width - 24, bottom)], line=1, grey=True)
    return per_second


def _draw_section(canvas: Canvas, y: float, section: _Section, scale: _Scale) -> float:
    """Draw a heading and its rows from `y` downwards, and return where the next heading begins."""
    if section.owner:
        y += _GAP
        canvas.band(8, y + 1, canvas.width - 16, _HEAD - 2, "#e4e4e4")
        canvas.line([(8, y + 1), (canvas.width - 8, y + 1)], line=1.6)
        canvas.words(14, y + TEXT, section.owner, size=TEXT - 1, bold=True)
        y += _HEAD
    if section.group:
        canvas.band(8, y + 2, canvas.width - 16, _HEAD - 4)
        canvas.words(14, y + TEXT, section.group, size=SMALL, italic=True)
        y += _HEAD
    left = scale.left
    for row in section.rows:
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
                _draw_run(canvas, run, top, scale)
            top += _LANE
        y += height
    return y


_BADGE = 34.0
"""The width from which a bar has the number of its thread."""


def _draw_run(canvas: Canvas, run: Run, top: float, scale: _Scale) -> None:
    begin, end = max(run.begin, 0.0), min(run.end, scale.length)
    x, width = scale.left + begin * scale.per_second, max((end - begin) * scale.per_second, 4.0)
    canvas.box(x, top + 3, width, _LANE - 6, look=scale.looks[_callback(run)], dashed=not run.ended)
    if scale.by == "callback" and width > _BADGE:
        canvas.badge(x + width / 2, top + _LANE / 2, str(run.thread), SMALL - 1)


def _least(left: float, length: float) -> float:
    """Return the seconds from which a bar has the number of its thread."""
    return _BADGE / ((WIDTH - 24 - left) / length)


@dataclass(frozen=True)
class _Key:
    """A mark, and what it means."""

    words: str
    look: int | None = None
    dashed: bool = False
    badge: bool = False


_KEY_LINE = 28.0


def _keys(shown: Mapping[str, Sequence[Run]], looks: Mapping[_Callback, int], badge_from: float) -> list[_Key]:
    """Return what the marks in a picture mean; `looks` are those of callbacks that no row names."""
    runs = [run for own in shown.values() for run in own]
    names = Counter(name for _, name in looks)
    keys = [
        _Key(f"{name} of {node}" if names[name] > 1 and node else name, look) for (node, name), look in looks.items()
    ]
    if runs and not looks:
        keys.append(_Key("one run of a callback"))
        if any(run.end - run.begin > badge_from for run in runs):
            keys.append(_Key("the thread on which it ran", badge=True))
    if any(not run.ended for run in runs):
        keys.append(_Key("still running when the picture was made", dashed=True))
    return keys


def _key_lines(keys: Sequence[_Key]) -> list[list[tuple[float, _Key]]]:
    """Distribute the keys to lines; each is returned with where it begins. The first line leaves room for "seconds"."""
    lines: list[list[tuple[float, _Key]]] = [[]]
    x, end = 14.0, WIDTH - 24 - width_of("seconds", SMALL)
    for key in keys:
        width = 54 + width_of(key.words, SMALL)
        if x + width > end:
            lines.append([])
            x, end = 14.0, WIDTH
        lines[-1].append((x, key))
        x += width
    return lines


def _draw_key(canvas: Canvas, y: float, lines: Sequence[Sequence[tuple[float, _Key]]]) -> None:
    for line in lines:
        for x, key in line:
            if key.badge:
                canvas.badge(x + 13, y + 6, "1", SMALL - 1)
            else:
                canvas.box(x, y - 4, 26, 20, look=key.look, dashed=key.dashed)
            canvas.words(x + 34, y + 12, key.words, size=SMALL)
        y += _KEY_LINE


def _alt(shown: Mapping[str, Sequence[Run]], length: float) -> str:
    told = []
    for title, runs in shown.items():
        several = len({run.node for run in runs}) > 1
        rows = []
        for node, name in dict.fromkeys(map(_callback, runs)):
            own = Runs(run for run in runs if _callback(run) == (node, name))
            times = "once" if len(own) == 1 else f"{len(own)} times, each"
            of = f" of {node}" if several and node else ""
            rows.append(f"{name}{of} ran {times} for at most {own.longest(name):.2f} seconds, on {_on_threads(own)}")
        most = Runs(runs).overlap()
        told.append(
            f"{title + ': ' if title else ''}{'; '.join(rows) or 'no callback ran'}"
            + (f"; at most {most} at once." if rows else ".")
        )
    return f"Timeline of {length:.1f} seconds. " + " ".join(told)
