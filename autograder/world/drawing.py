"""Draws a world as it is, with the trails of its cars, and as a film strip of moments."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from autograder.core.results import Picture
from autograder.pictures.svg import SMALL, TEXT, WIDTH, Canvas, width_of
from autograder.world.car import LENGTH, placed
from autograder.world.car import WIDTH as CAR_WIDTH
from autograder.world.room import BOX, WALL, Pose, Room
from autograder.world.simulation import STEP, Record, Sample, Simulation, Touch

LOOKS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")
"""The colours of the cars (Okabe and Ito); each car also has its number, and a line of its own."""
_PARKED = "#bbbbbb"
_TALLEST = 620.0
_POINTS = 600
"""The points of a trail that are drawn."""
_BADGES = 20
"""The badges with seconds that a trail has at the most."""
_MARGIN = 40.0
_BRAKE, _BRAKE_IN_STRIP = 9.0, 3.0
"""The side of the square where a car was braked, in a still and in a film strip."""
_BESIDE = 2.0
"""The way from the trail to that square, in sides of it, so that it does not cover the seconds."""


@dataclass(frozen=True)
class Way:
    """What one car did, as far as it is drawn."""

    name: str
    trail: Sequence[Sample]
    touches: Sequence[Touch] = ()
    brakes: Sequence[Sample] = ()
    """Where the watchdog began to brake the car, and it drove on later."""

    def between(self, begin: float, end: float) -> Way:
        """Return the part of the way from one moment to another."""
        return replace(
            self,
            trail=[one for one in self.trail if begin <= one.time <= end],
            touches=[one for one in self.touches if begin <= one.time <= end],
            brakes=[one for one in self.brakes if begin <= one.time <= end],
        )


@dataclass(frozen=True)
class Mark:
    """A point of the map that matters, such as the one at which something went wrong."""

    x: float
    y: float
    text: str
    """A sentence below the picture."""


@dataclass(frozen=True)
class Drawn:
    """All that is drawn of a world."""

    room: Room
    ways: Sequence[Way]
    parked: Sequence[Pose]


def drawn(world: Simulation) -> Drawn:
    """Return what is to be drawn of a world at this moment."""
    with world.lock:
        ways = [_way(world, name, record) for name, record in world.records.items()]
        return Drawn(world.room, ways, [car.pose for car in world.cars if not car.driven])


def _way(world: Simulation, name: str, record: Record) -> Way:
    car = world.driven[name]
    trail = list(record.trail) or [Sample(world.time, car.pose, car.speed, False)]
    if trail[-1].pose != car.pose:  # it has been placed since
        trail.append(Sample(world.time, car.pose, car.speed, False))
    # A program that ends leaves its car to the watchdog; that is no place at which the car was held up.
    driven = max((one.time for one in trail if not one.braked and one.speed), default=0.0)
    return Way(name, trail, list(record.touches), [one for one in record.brakes if one.time < driven])


class _Panel:
    """A room on a part of a canvas."""

    def __init__(self, canvas: Canvas, room: Room, left: float, top: float, scale: float) -> None:
        self._canvas, self._room, self._left, self._top, self._scale = canvas, room, left, top, scale

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Return where a point of the map is on the canvas."""
        return self._left + x * self._scale, self._top + (self._room.height - y) * self._scale

    def floor(self, names: bool) -> None:
        """Draw the floor, the places, the walls and the boxes."""
        room, scale = self._room, self._scale
        self._canvas.band(self._left, self._top, room.width * scale, room.height * scale, "#ffffff")
        for number, place in enumerate(room.places):
            cells = [self._blocks(one) for one in blocks(room.floor == number, room.cell)]
            for x, y, width, height in cells:
                self._canvas.box(x, y, width, height, fill="#f4ee9c", dashed=True)
            x, y, width, height = max(cells, key=lambda one: one[2] * one[3])
            if names:  # at the upper edge, because a car that has arrived stands in the middle
                down = SMALL if height > 2 * SMALL else height / 2 + 6
                self._canvas.words(x + width / 2, y + down, place, size=SMALL, anchor="middle", halo=True)
        for kind, look in ((WALL, None), (BOX, 6)):
            for one in blocks(room.solid == kind, room.cell):
                self._canvas.box(*self._blocks(one), look=look, fill="#555555", line=0.6 if look is None else 1.2)

    def _blocks(self, block: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
        x, y, width, height = block
        left, top = self.at(x, y + height)
        return left, top, width * self._scale, height * self._scale

    def trail(self, way: Way, dashed: bool, seconds: bool) -> None:
        """Draw where a car was, with a badge for each few seconds."""
        pieces: list[list[Sample]] = [[]]
        for sample in way.trail:
            if pieces[-1] and _jumped(pieces[-1][-1].pose, sample.pose):
                pieces.append([])
            pieces[-1].append(sample)
        for piece in pieces:
            every = max(1, len(piece) // _POINTS)
            points = [self.at(*one.pose[:2]) for one in [*piece[::every], piece[-1]]] if piece else []
            if len(set(points)) > 1:
                self._canvas.line(points, line=2.4, dashed=dashed)
        if seconds and way.trail:
            self._seconds(way)

    def _seconds(self, way: Way) -> None:
        begin, length = way.trail[0].time, way.trail[-1].time - way.trail[0].time
        every = next((one for one in (1, 2, 5, 10, 30, 60, 300) if length / one <= _BADGES), length)
        last: Pose | None = None
        for number in range(1, int(length / every) + 1):
            sample = way.trail[min(len(way.trail) - 1, round(number * every / STEP))]
            far = 34 / self._scale
            if last is None or math.hypot(sample.pose.x - last.x, sample.pose.y - last.y) > far:
                last = sample.pose
                self._canvas.badge(*self.at(last.x, last.y), f"{begin + number * every:.0f}", SMALL - 4)

    def car(self, pose: Pose, colour: str, label: str) -> None:
        """Draw a car with its nose."""
        corners = placed(np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)]) * (LENGTH / 2, CAR_WIDTH / 2), pose)
        nose = placed(np.array([(LENGTH / 2, 0), (0.02, CAR_WIDTH / 2.6), (0.02, -CAR_WIDTH / 2.6)]), pose)
        self._canvas.path(self._closed(corners), fill=colour, line=1.6)
        self._canvas.path(self._closed(nose), fill="#ffffff", line=1.2)
        if label:
            x, y = self.at(pose.x, pose.y)
            self._canvas.words(x, y - LENGTH / 2 * self._scale - 8, label, size=SMALL, anchor="middle", halo=True)

    def _closed(self, corners: Any) -> str:
        return "M" + "L".join("{:.1f} {:.1f}".format(*self.at(*corner)) for corner in corners) + "Z"

    def brake(self, pose: Pose, size: float) -> None:
        """Draw a square of this size beside the trail, where the watchdog began to brake a car."""
        x, y = self.at(pose.x, pose.y)
        left, top = x + _BESIDE * size * math.sin(pose.heading), y + _BESIDE * size * math.cos(pose.heading)
        self._canvas.box(left - size / 2, top - size / 2, size, size, fill="#000")

    def cross(self, x: float, y: float, size: float = 14.0) -> None:
        """Draw a cross in a ring around a point."""
        across, down = self.at(x, y)
        arm, twice = size / 2, 2 * size
        circle = (
            f"M{across - size:.1f} {down:.1f}a{size:g} {size:g} 0 1 0 {twice:g} 0a{size:g} {size:g} 0 1 0 {-twice:g} 0"
        )
        self._canvas.path(circle, line=size / 5)
        self._canvas.path(f"M{across - arm:.1f} {down - arm:.1f}l{size:g} {size:g}", line=size / 5)
        self._canvas.path(f"M{across + arm:.1f} {down - arm:.1f}l{-size:g} {size:g}", line=size / 5)


def thinned(poses: Sequence[Pose], apart: float) -> list[tuple[Pose, bool]]:
    """Return the first pose and those that are so many metres apart, each with whether the car was put there."""
    found: list[tuple[Pose, bool]] = []
    before: Pose | None = None
    for pose in poses:
        jumped = before is not None and _jumped(before, pose)
        if not found or jumped or math.hypot(pose.x - found[-1][0].x, pose.y - found[-1][0].y) >= apart:
            found.append((pose, jumped))
        before = pose
    return found


def _jumped(one: Pose, other: Pose) -> bool:
    """Whether a car cannot have driven from one pose to the next: it was reset or placed."""
    return math.hypot(one.x - other.x, one.y - other.y) > 0.2


def blocks(cells: Any, cell: float) -> list[tuple[float, float, float, float]]:
    """Join cells to rectangles (x, y, width, height) in metres."""
    rows, left = cells.shape[0], np.array(cells)
    found = []
    for row, column in np.argwhere(left):
        if not left[row, column]:
            continue
        line = left[row, column:]
        wide = int(np.argmin(line)) if not line.all() else len(line)
        high = 1
        while row + high < rows and left[row + high, column : column + wide].all():
            high += 1
        left[row : row + high, column : column + wide] = False
        found.append((column * cell, row * cell, wide * cell, high * cell))
    return found


def still(world: Drawn, marks: Sequence[Mark] = ()) -> Picture:
    """Draw a world with the trails of its cars; a cross and a sentence show each mark."""
    room = world.room
    scale = min((WIDTH - 2 * _MARGIN) / room.width, _TALLEST / room.height)
    lines = [one for mark in marks for one in _wrapped("✗", mark.text)]
    if not marks and any(way.touches for way in world.ways):  # otherwise a mark tells it
        lines += _wrapped("✗", "The car touched something here.")
    if any(way.brakes for way in world.ways):
        lines += _wrapped("■", "The motors braked here, because no command or no heartbeat had come for 0.3 s.")
    foot = 52 + (len(lines) + (1 if lines else 0)) * (SMALL + 8)
    canvas = Canvas(18 + room.height * scale + foot, WIDTH)
    panel = _Panel(canvas, room, (WIDTH - room.width * scale) / 2, 18, scale)
    _fill(panel, world, names=True)
    for mark in marks:
        panel.cross(mark.x, mark.y)
    _ruler(canvas, panel, room)
    for number, line in enumerate(lines):
        canvas.words(_MARGIN, 18 + room.height * scale + 66 + number * (SMALL + 8), line, size=SMALL)
    return canvas.picture(in_words(world, marks))


def _fill(panel: _Panel, world: Drawn, names: bool) -> None:
    panel.floor(names)
    for number, way in enumerate(world.ways):
        panel.trail(way, dashed=bool(number % 2), seconds=names)
        for brake in way.brakes:
            panel.brake(brake.pose, _BRAKE if names else _BRAKE_IN_STRIP)
    for pose in world.parked:
        panel.car(pose, _PARKED, "parked" if names else "")
    for number, way in enumerate(world.ways):
        panel.car(way.trail[-1].pose, LOOKS[number % len(LOOKS)], way.name if names else "")
        for touch in way.touches:
            panel.cross(touch.x, touch.y, 14.0 if names else 7.0)


def _ruler(canvas: Canvas, panel: _Panel, room: Room) -> None:
    """Write the metres along the lower and the left edge."""
    every = next(one for one in (1, 2, 5, 10, 50) if max(room.width, room.height) / one <= 14)
    for x in range(0, int(room.width) + 1, every):
        across, down = panel.at(x, 0)
        canvas.line([(across, down), (across, down + 6)], line=1)
        canvas.words(across, down + 8 + SMALL, f"{x}", size=SMALL, anchor="middle")
    for y in range(0, int(room.height) + 1, every):
        across, down = panel.at(0, y)
        canvas.line([(across - 6, down), (across, down)], line=1)
        canvas.words(across - 10, down + 5, f"{y}", size=SMALL, anchor="end")
    across, down = panel.at(room.width, 0)
    canvas.words(
        across, down + 14 + 2 * SMALL, "metres; the numbers along a trail are seconds", size=SMALL, anchor="end"
    )


def _wrapped(sign: str, text: str) -> list[str]:
    lines = [sign]
    for word in text.split():
        if width_of(f"{lines[-1]} {word}", SMALL) > WIDTH - 2 * _MARGIN:
            lines.append("   ")
        lines[-1] += f" {word}"
    return lines


def strip(world: Drawn, frames: int = 6, seconds: float | None = None) -> Picture:
    """Draw moments of the way, or of its last seconds, up to the end, one beside the other like a film."""
    room = world.room
    if seconds is not None:
        since = _times(world)[1] - seconds
        world = replace(world, ways=[way.between(since, math.inf) for way in world.ways])
    begin, end = _times(world)
    columns = min(3, frames)
    rows = math.ceil(frames / columns)
    gap = 14.0
    wide = (WIDTH - (columns + 1) * gap) / columns
    scale = min(wide / room.width, _TALLEST / 2 / room.height)
    high = room.height * scale + TEXT + 16
    canvas = Canvas(rows * high + gap, WIDTH)
    for number in range(frames):
        time = begin + (end - begin) * number / max(1, frames - 1)
        row, column = divmod(number, columns)
        left, top = gap + column * (wide + gap) + (wide - room.width * scale) / 2, gap + row * high
        now = replace(world, ways=[_at_least_one(way.between(begin, time + STEP / 2), way) for way in world.ways])
        _fill(_Panel(canvas, room, left, top, scale), now, names=False)
        canvas.words(left, top + room.height * scale + TEXT + 2, f"{time:.1f} s", size=SMALL)
    return canvas.picture(f"{frames} moments from {begin:.1f} s to {end:.1f} s. {in_words(world)}")


def _at_least_one(part: Way, whole: Way) -> Way:
    return part if part.trail else replace(part, trail=whole.trail[:1])


def _times(world: Drawn) -> tuple[float, float]:
    return min(way.trail[0].time for way in world.ways), max(way.trail[-1].time for way in world.ways)


def in_words(world: Drawn, marks: Sequence[Mark] = ()) -> str:
    """Say what a picture of the world shows."""
    room = world.room
    places = f" with the place {', '.join(room.places)}" if room.places else ""
    said = [f"A room of {room.width:g} m by {room.height:g} m{places}, seen from above."]
    said += [_told(way, room) for way in world.ways]
    if world.parked:
        said.append(f"{len(world.parked)} parked car{'s' if len(world.parked) > 1 else ''}.")
    return " ".join([*said, *(mark.text for mark in marks)])


def _told(way: Way, room: Room) -> str:
    first, last = way.trail[0], way.trail[-1]
    car = f"The car /{way.name}" if way.name else "The car"
    metres = sum(
        math.hypot(one.pose.x - other.pose.x, one.pose.y - other.pose.y)
        for one, other in pairwise(way.trail)
        if not _jumped(one.pose, other.pose)
    )
    place = room.place_at(last.pose.x, last.pose.y)
    where = f"at ({last.pose.x:.1f}, {last.pose.y:.1f})" + (f" on {place}" if place else "")
    if metres < 0.01:
        return f"{car} stands {where}."
    touched = f"; it touched something {'once' if len(way.touches) == 1 else f'{len(way.touches)} times'}"
    touched = touched if way.touches else "; it touched nothing"
    times = "once" if len(way.brakes) == 1 else f"{len(way.brakes)} times"
    touched += f"; its motors braked {times} on the way" if way.brakes else ""
    return (
        f"{car} drove {metres:.1f} m from ({first.pose.x:.1f}, {first.pose.y:.1f}) in {last.time - first.time:.1f} s"
        f" and is {where}{touched}."
    )
