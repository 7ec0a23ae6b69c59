"""A car: how it moves, and the shape that it has."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from autograder.world.room import Pose

LENGTH, WIDTH = 0.4, 0.24
"""The car in metres; `base_link` is its middle."""
FASTEST = 1.0
"""The highest speed in metres per second, forwards and backwards."""
FASTEST_TURN = 2.5
"""The highest turning speed in radians per second."""
GAINS = 1.5
"""How fast the speed can grow, in metres per second squared."""
BRAKES = 3.0
"""How fast the speed can fall, in metres per second squared: from the highest speed, the car stops in a third of a
second, after 0.17 m."""
TURNS = 10.0
"""How fast the turning speed can change, in radians per second squared."""
FULL, EMPTY = 12.6, 9.9
"""The battery's voltages."""
IDLE, PER_METRE = 1 / 7200, 1 / 2000
"""The share of the charge that is used in a second and for a metre: it is empty after two hours, or after 2 km."""


def outline(spacing: float) -> Any:
    """Return points on the edge of a car, as seen from its middle, not farther apart than `spacing` metres."""
    corners = [(1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1)]
    points: list[Any] = []
    for (from_x, from_y), (to_x, to_y) in pairwise(corners):
        length = LENGTH if from_x != to_x else WIDTH
        share = np.linspace(0, 1, max(2, math.ceil(length / spacing) + 1))[:-1, None]
        begin, end = np.array([from_x, from_y]), np.array([to_x, to_y])
        points.append((begin + share * (end - begin)) * (LENGTH / 2, WIDTH / 2))
    return np.concatenate(points)


def placed(points: Any, pose: Pose) -> Any:
    """Return points that are given as seen from a car's middle as points of the map."""
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    return points @ np.array([[cos, sin], [-sin, cos]]) + (pose.x, pose.y)


def below(pose: Pose, points: Any) -> Any:
    """Return those of these points of the map that are below a car."""
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    own = (points - (pose.x, pose.y)) @ np.array([[cos, -sin], [sin, cos]])
    return points[(np.abs(own[:, 0]) <= LENGTH / 2) & (np.abs(own[:, 1]) <= WIDTH / 2)]


def edges(pose: Pose) -> Any:
    """Return the four edges of a car as rows (x1, y1, x2, y2)."""
    corners = placed(np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)]) * (LENGTH / 2, WIDTH / 2), pose)
    return np.concatenate([corners, np.roll(corners, -1, axis=0)], axis=1)


@dataclass
class Car:
    """A car and what it does at this moment."""

    name: str
    """Its namespace without slashes at the ends; empty for a car without one."""
    start: Pose
    driven: bool = True
    """Whether ROS drives it; another one is parked."""
    pose: Pose = field(init=False)
    speed: float = 0.0
    turn: float = 0.0
    charge: float = 1.0
    """The share of the battery's charge that is left."""
    wanted: tuple[float, float] = (0.0, 0.0)
    """The last command: metres and radians per second."""
    commanded: float = -math.inf
    """When it came, in the world's seconds."""
    beat: float = -math.inf
    """When the last heartbeat came, in the world's seconds."""
    braked: bool = True
    """Whether the watchdog keeps it from driving."""
    touches: str = ""
    """What it touches now: `a wall`, `a box` or `a car`; empty if it touches nothing."""

    def __post_init__(self) -> None:
        self.pose = self.start

    def back(self, pose: Pose | None = None) -> None:
        """Put the car where it began, or somewhere else. It stands, and has got no command yet."""
        self.pose = pose or self.start
        self.speed = self.turn = 0.0
        self.wanted, self.commanded, self.beat, self.touches = (0.0, 0.0), -math.inf, -math.inf, ""

    def accelerate(self, wanted: tuple[float, float], seconds: float) -> None:
        """Change the speeds towards what is wanted, as far as motors and brakes can in this time."""
        speed = min(max(wanted[0], -FASTEST), FASTEST)
        turn = min(max(wanted[1], -FASTEST_TURN), FASTEST_TURN)
        slower = abs(speed) < abs(self.speed) or speed * self.speed < 0
        self.speed = _towards(self.speed, speed, (BRAKES if slower else GAINS) * seconds)
        self.turn = _towards(self.turn, turn, TURNS * seconds)

    def moved(self, seconds: float) -> Pose:
        """Return where the car would be after this time with its present speeds."""
        half = self.pose.heading + self.turn * seconds / 2
        way = self.speed * seconds
        heading = math.remainder(self.pose.heading + self.turn * seconds, math.tau)
        return Pose(self.pose.x + way * math.cos(half), self.pose.y + way * math.sin(half), heading)

    def use_battery(self, seconds: float) -> None:
        """Take what this time and the way in it cost from the battery."""
        self.charge = max(0.0, self.charge - IDLE * seconds - PER_METRE * abs(self.speed) * seconds)


def _towards(now: float, wanted: float, most: float) -> float:
    return min(max(wanted, now - most), now + most)
