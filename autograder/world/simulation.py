"""The world in steps of equal length, and the record of what its cars did.

A step is always the same time, whenever it is taken: on a busy machine the world goes slower, like the programs that
drive in it. With the same seed and the same commands at the same steps, everything happens again in the same way.
"""

from __future__ import annotations

import math
import random
import threading
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from autograder.world import car as cars
from autograder.world.car import Car
from autograder.world.rays import CAR, cast, photograph
from autograder.world.room import BOX, Pose, Room

STEP = 0.05
"""The seconds of a step: 20 of them are a second of the world."""
WATCHDOG = 0.3
"""The seconds without a command, or without a heartbeat, after which the motors brake."""
STANDS = 0.01
"""The speed in metres per second below which a car stands."""
RAYS = 180
RANGE_MIN, RANGE_MAX = 0.05, 8.0
"""What the lidar can measure, in metres."""
NOISE = 0.01
"""The standard deviation of the lidar, in metres."""
CLEAR = 0.03
"""The metres that must be free around a car before it can touch the same thing again."""
KEPT = 20 * 60 * 20
"""The samples that are kept of a car: twenty minutes."""
TOUCHES_KEPT = BRAKES_KEPT = 1000


class Sample(NamedTuple):
    """Where a car was after a step."""

    time: float
    """Seconds of the world since its beginning."""
    pose: Pose
    speed: float
    """Metres per second; negative backwards."""
    braked: bool
    """Whether the watchdog braked in it, because no command or no heartbeat came."""


class Touch(NamedTuple):
    """A car began to touch something."""

    time: float
    pose: Pose
    what: str
    """`a wall`, `a box` or `a car`."""
    x: float
    """Where they touch, in metres."""
    y: float


@dataclass
class Record:
    """What one car did."""

    trail: deque[Sample] = field(default_factory=lambda: deque(maxlen=KEPT))
    touches: deque[Touch] = field(default_factory=lambda: deque(maxlen=TOUCHES_KEPT))
    brakes: deque[Sample] = field(default_factory=lambda: deque(maxlen=BRAKES_KEPT))
    """Where the car drove when the watchdog began to brake it."""
    places: dict[str, float] = field(default_factory=dict)
    """When the car's middle came onto each place for the first time, by the place's name."""
    metres: float = 0.0
    commands: int = 0
    """The commands that came."""
    passed_over: float = -math.inf
    """When the last command came that was not finite."""


class Simulation:
    """Cars in a room.

    Args:
        room: the map.
        names: the namespaces of the cars that are driven, in the order of the map's arrows; the other ones are parked.
        heartbeat: whether the motors also need a heartbeat.
        seed: of the lidar's noise.
        rays: the number of the lidar's rays.

    Raises:
        ValueError: the map has fewer cars than names.
    """

    def __init__(
        self, room: Room, names: Sequence[str] = ("",), *, heartbeat: bool = False, seed: int = 0, rays: int = RAYS
    ) -> None:
        """Put the cars where the map has them."""
        if len(names) > len(room.starts):
            raise ValueError(f"{len(names)} cars are to be driven, and the map has {len(room.starts)}")
        self.room, self.heartbeat = room, heartbeat
        self.cars = [
            Car(names[number], start) if number < len(names) else Car(f"parked{number}", start, driven=False)
            for number, start in enumerate(room.starts)
        ]
        self.driven = {car.name: car for car in self.cars if car.driven}
        self.records = {name: Record() for name in self.driven}
        self.angles = -math.pi + np.arange(rays) * (2 * math.pi / rays)
        """The lidar's directions, as seen from the car."""
        self.steps = 0
        self.lock = threading.RLock()
        """Held while the world changes; hold it to read several things of one moment."""
        self._outline = cars.outline(min(room.cell, 0.2) / 2)
        self._around = self._outline * (1 + 2 * CLEAR / cars.LENGTH, 1 + 2 * CLEAR / cars.WIDTH)
        self._seed = random.Random(seed).getrandbits(64)

    @property
    def time(self) -> float:
        """Seconds of the world since its beginning."""
        return self.steps * STEP

    def command(self, name: str, speed: float, turn: float) -> bool:
        """Tell a car how fast to drive and to turn; return False if one is not finite, so that it is passed over."""
        finite = math.isfinite(speed) and math.isfinite(turn)
        with self.lock:
            self.records[name].commands += 1
            if finite:
                car = self.driven[name]
                car.wanted, car.commanded = (speed, turn), self.time
            else:
                self.records[name].passed_over = self.time
        return finite

    def beat(self, name: str) -> None:
        """Note a heartbeat of a car."""
        with self.lock:
            self.driven[name].beat = self.time

    def missing(self, car: Car) -> str:
        """Return what the watchdog of a car misses, `command` or `heartbeat`; empty if it lets the car drive."""
        if self.time - car.commanded > WATCHDOG + STEP / 2:
            return "command"
        return "heartbeat" if self.heartbeat and self.time - car.beat > WATCHDOG + STEP / 2 else ""

    def reset(self, name: str) -> None:
        """Put a car where it began. What it did so far stays in its record."""
        with self.lock:
            self.driven[name].back()

    def place(self, name: str, pose: Pose) -> str:
        """Put a car somewhere. Return why that is not possible, or an empty text."""
        if not all(map(math.isfinite, pose)):
            return "x, y and heading are finite numbers"
        with self.lock:
            car = self.driven[name]
            found = self._touched(car, pose)
            if found is not None:
                return f"{found[0]} is at ({found[1]:.2f}, {found[2]:.2f})"
            car.back(Pose(pose.x, pose.y, math.remainder(pose.heading, math.tau)))
        return ""

    def step(self) -> None:
        """Let one step go by."""
        with self.lock:
            for name, car in self.driven.items():
                self._drive(car, self.records[name])
            self.steps += 1
            for name, car in self.driven.items():
                record = self.records[name]
                record.trail.append(Sample(self.time, car.pose, car.speed, car.braked))
                place = self.room.place_at(car.pose.x, car.pose.y)
                if place:
                    record.places.setdefault(place, self.time)

    def _drive(self, car: Car, record: Record) -> None:
        was_braked, car.braked = car.braked, bool(self.missing(car))
        if car.braked and not was_braked and abs(car.speed) > STANDS:
            record.brakes.append(Sample(self.time, car.pose, car.speed, braked=True))
        car.accelerate((0.0, 0.0) if car.braked or not car.charge else car.wanted, STEP)
        car.use_battery(STEP)
        if not car.speed and not car.turn:
            return
        pose = car.moved(STEP)
        found = self._touched(car, pose)
        if found is None:
            record.metres += math.hypot(pose.x - car.pose.x, pose.y - car.pose.y)
            car.pose = pose
            if car.touches and self._touched(car, pose, self._around) is None:
                car.touches = ""
            return
        what, x, y = found
        if what != car.touches:
            record.touches.append(Touch(self.time, car.pose, what, x, y))
        car.touches, car.speed, car.turn = what, 0.0, 0.0

    def _touched(self, car: Car, pose: Pose, outline: Any = None) -> tuple[str, float, float] | None:
        """Return what a car, or an outline around it, would touch at a pose, and where; None if it is nothing."""
        points = cars.placed(self._outline if outline is None else outline, pose)
        hit = self.room.is_solid(points)
        if np.any(hit):
            x, y = points[np.argmax(hit)]
            return "a box" if self.room.kind_at(x, y) == BOX else "a wall", float(x), float(y)
        for other in self.cars:
            if other is not car:
                both = cars.below(other.pose, points), cars.below(pose, cars.placed(self._outline, other.pose))
                for inside in both:
                    if len(inside):
                        return "a car", float(inside[0, 0]), float(inside[0, 1])
        return None

    def _seen_by(self, car: Car) -> tuple[Any, Any]:
        """Return the edges around a car and their kinds: those of the room and of the other cars."""
        others = [cars.edges(other.pose) for other in self.cars if other is not car]
        segments = np.concatenate([self.room.segments, *others])
        return segments, np.concatenate([self.room.edge_of, np.full(4 * len(others), CAR)])

    def scan(self, name: str) -> Any:
        """Return what the lidar of a car measures in each direction: metres, or infinity if nothing is near."""
        with self.lock:
            car = self.driven[name]
            pose, segments = car.pose, self._seen_by(car)[0]
        metres, _ = cast(pose.x, pose.y, pose.heading + self.angles, segments)
        # The noise depends on the step alone, and so not on when somebody subscribes.
        noise = np.random.default_rng([self._seed, list(self.driven).index(name), self.steps])
        metres = np.maximum(metres + noise.normal(0.0, NOISE, len(metres)), RANGE_MIN)
        return np.where(metres <= RANGE_MAX, metres, np.inf).astype(np.float32)

    def picture(self, name: str) -> Any:
        """Return what the camera of a car sees, as an array of red, green and blue for each pixel."""
        with self.lock:
            car = self.driven[name]
            pose, (segments, kinds) = car.pose, self._seen_by(car)
        return photograph(self.room, pose.x, pose.y, pose.heading, segments, kinds)
