"""Rooms: a map seen from above, which a lab author draws with letters in a small YAML file.

    cell: 0.25
    places:
      P: parking
    map: |
      ############
      #>      %  #
      #       PP #
      ############

A `#` is a wall, a `%` a box, and a letter a cell of the place with this name. An arrow (`>`, `<`, `^`, `v`) is a car
that looks that way. A space or a dot is free floor. One letter is `cell` metres wide and high. As REP 103 has it, x
points to the right, y up, and angles grow counter-clockwise from x; the origin is the lower left corner of the map.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from autograder.core import student_yaml
from autograder.core.errors import KitError
from autograder.reasons import Refused

MAPS = Path(__file__).parent / "maps"
"""The kit's own rooms."""

FREE, WALL, BOX = 0, 1, 2
HEADINGS = {">": 0.0, "^": math.pi / 2, "<": math.pi, "v": -math.pi / 2}
MOST_CELLS = 10_000
SMALLEST, LARGEST = 0.05, 2.0
"""The metres that a cell may measure."""

_FORM = "Draw it with # for walls, % for boxes, > < ^ v for cars, and the letters of `places:`; the rest is free floor."


class Pose(NamedTuple):
    """Where a car is, in metres from the lower left corner of the map, and its heading in radians, 0 along x."""

    x: float
    y: float
    heading: float


@dataclass(frozen=True)
class Room:
    """A map that has been read."""

    name: str
    cell: float
    """The width of a cell in metres."""
    solid: Any
    """FREE, WALL or BOX for each cell, as an array; row 0 is the lowest."""
    floor: Any
    """The number of the place in `places` that each cell belongs to, as an array; -1 for none."""
    places: tuple[str, ...]
    starts: tuple[Pose, ...]
    """Where the cars are at first, in the order in which the map is read."""
    segments: Any
    """The edges of walls and boxes as an array with a row (x1, y1, x2, y2) for each."""
    edge_of: Any
    """WALL or BOX for each row of `segments`."""

    @property
    def width(self) -> float:
        """Metres from left to right."""
        return float(self.solid.shape[1] * self.cell)

    @property
    def height(self) -> float:
        """Metres from bottom to top."""
        return float(self.solid.shape[0] * self.cell)

    def without_boxes(self) -> Room:
        """Return the same room with free floor where its boxes are."""
        solid = np.where(self.solid == BOX, FREE, self.solid)
        segments, edge_of = _edges(solid, self.cell)
        return replace(self, solid=solid, segments=segments, edge_of=edge_of)

    def is_solid(self, points: Any) -> Any:
        """Tell for each row (x, y) whether a wall or a box, or the outside, is there."""
        column = np.floor(points[:, 0] / self.cell).astype(int)
        row = np.floor(points[:, 1] / self.cell).astype(int)
        rows, columns = self.solid.shape
        inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        return ~inside | (self.solid[np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1)] != FREE)

    def kind_at(self, x: float, y: float) -> int:
        """Return FREE, WALL or BOX for a point; outside of the map is a wall."""
        row, column = int(y // self.cell), int(x // self.cell)
        rows, columns = self.solid.shape
        return int(self.solid[row, column]) if 0 <= row < rows and 0 <= column < columns else WALL

    def place_at(self, x: float, y: float) -> str:
        """Return the name of the place at a point, or an empty text."""
        row, column = int(y // self.cell), int(x // self.cell)
        rows, columns = self.floor.shape
        number = int(self.floor[row, column]) if 0 <= row < rows and 0 <= column < columns else -1
        return self.places[number] if number >= 0 else ""

    def distance_to(self, place: str, x: float, y: float) -> float:
        """Return the metres from a point to the nearest cell of a place; 0 on it."""
        rows, columns = np.nonzero(self.floor == self.places.index(place))
        away_x = np.maximum(np.abs(x - (columns + 0.5) * self.cell) - self.cell / 2, 0)
        away_y = np.maximum(np.abs(y - (rows + 0.5) * self.cell) - self.cell / 2, 0)
        return float(np.min(np.hypot(away_x, away_y)))


def read_room(name: str, folder: Path | None = None) -> Room:
    """Read a room.

    Args:
        name: a file such as `garage.yaml`, or one of the kit's own rooms, such as `room`.
        folder: the folder of the file.

    Raises:
        KitError: there is no such room, or its file cannot be read.
    """
    path = (folder or Path()) / name if name.endswith(".yaml") else MAPS / f"{name}.yaml"
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        known = ", ".join(sorted(f"`{path.stem}`" for path in MAPS.glob("*.yaml")))
        raise KitError(
            f"There is no room `{name}`.", f"A file of your own ends with .yaml; the kit's own rooms are {known}."
        ) from None
    return room_from(text, name)


def room_from(text: str, name: str) -> Room:
    """Read a room from the text of its file.

    Raises:
        KitError: it cannot be read; the sentence says where and why.
    """
    try:
        given = student_yaml.load(text)
    except Refused as error:
        raise KitError(f"The room `{name}` cannot be read: {error.reason.because}", _FORM) from None
    given = given if isinstance(given, dict) else {}
    cell, drawing, letters = given.get("cell", 0.25), given.get("map"), given.get("places") or {}
    unknown = sorted(map(str, given.keys() - {"cell", "map", "places"}))
    if unknown:
        raise _refused(name, f"it has no `{unknown[0]}`", "The file has `map`, `cell` and `places`.")
    if isinstance(cell, bool) or not isinstance(cell, (int, float)) or not SMALLEST <= cell <= LARGEST:
        raise _refused(name, f"`cell` is {cell!r}", f"It is a number of metres from {SMALLEST:g} to {LARGEST:g}.")
    if not isinstance(letters, dict) or not all(_is_letter(one) and isinstance(letters[one], str) for one in letters):
        raise _refused(name, "`places` is not a list of letters with names", "Write it as in `places: {P: parking}`.")
    if not isinstance(drawing, str) or not drawing.strip():
        raise _refused(name, "it has no `map`", _FORM)
    return _drawn(name, float(cell), [line.rstrip() for line in drawing.rstrip().splitlines()], letters)


def _is_letter(one: object) -> bool:
    return isinstance(one, str) and len(one) == 1 and one.isalpha() and one not in HEADINGS


def _refused(name: str, because: str, do: str) -> KitError:
    return KitError(f"The room `{name}` cannot be used: {because}.", do)


def _drawn(name: str, cell: float, lines: list[str], letters: dict[str, str]) -> Room:
    rows, columns = len(lines), max(len(line) for line in lines)
    if rows * columns > MOST_CELLS:
        raise _refused(name, f"its map has {rows * columns} cells", f"A map has at most {MOST_CELLS}.")
    solid: Any = np.zeros((rows, columns), dtype=np.int8)
    floor: Any = np.full((rows, columns), -1, dtype=np.int16)
    names = tuple(dict.fromkeys(letters.values()))
    starts = []
    for number, line in enumerate(lines):
        row = rows - 1 - number
        for column, letter in enumerate(line):
            if letter in "#%":
                solid[row, column] = WALL if letter == "#" else BOX
            elif letter in HEADINGS:
                starts.append(Pose((column + 0.5) * cell, (row + 0.5) * cell, HEADINGS[letter]))
            elif letter in letters:
                floor[row, column] = names.index(letters[letter])
            elif letter not in " .":
                raise _refused(name, f"{letter!r} in line {number + 1} of the map, letter {column + 1}, has no meaning",
                               _FORM)  # fmt: skip
            if letter in HEADINGS:  # a car that is drawn within a place stands on it
                beside = {line[column - 1] if column else "", line[column + 1 : column + 2]}
                if len(beside) == 1 and beside <= letters.keys():
                    floor[row, column] = names.index(letters[beside.pop()])
    missing = [one for one in letters if all(one not in line for line in lines)]
    if missing:
        raise _refused(name, f"the map has no {missing[0]!r}, which `places` names", _FORM)
    if not starts:
        raise _refused(
            name, "its map has no car", "Draw one with >, <, ^ or v; it looks the way that the arrow points."
        )
    segments, edge_of = _edges(solid, cell)
    return Room(name, cell, solid, floor, names, tuple(starts), segments, edge_of)


def _edges(solid: Any, cell: float) -> tuple[Any, Any]:
    """Return the lines between free and solid cells, with neighbours of one kind joined to one line."""
    # Around the map is a wall, so that each ray ends somewhere.
    around = np.pad(solid, 1, constant_values=WALL)
    found: list[tuple[float, float, float, float]] = []
    kinds: list[int] = []
    for upright in (False, True):
        grid = around.T if upright else around
        for line in range(1, grid.shape[0]):
            below, above = grid[line - 1], grid[line]
            kind = np.where((below == FREE) == (above == FREE), FREE, np.maximum(below, above))
            changes = np.flatnonzero(np.diff(kind, prepend=FREE, append=FREE))
            for begin, end in pairwise(changes):
                if kind[begin] != FREE:
                    at, one, other = ((value - 1) * cell for value in (line, begin, end))
                    found.append((at, one, at, other) if upright else (one, at, other, at))
                    kinds.append(int(kind[begin]))
    return np.array(found, dtype=float), np.array(kinds)
