"""`ros.car`: what a car in the world of the launch did, as the world itself measured it."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING, NoReturn

from geometry_msgs.msg import Twist
from rclpy.qos import QoSProfile

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.expect.expectations import Expectations
from autograder.checks.message_text import was_an_int
from autograder.checks.misuse import Misuse
from autograder.checks.running_launch import RunningLaunch
from autograder.checks.waiting import waits_for
from autograder.core.results import Picture
from autograder.reasons import Group, Kind, Reason

if TYPE_CHECKING:  # loads numpy, which most labs do not need
    from autograder.world import Pose, RunningWorld, Sample, Touch
    from autograder.world.drawing import Mark
    from autograder.world.simulation import Record

PLACE_NOT_REACHED = Kind("place-not-reached", "the car did not come to the place in time", Group.WORLD)
TOUCHED = Kind("touched", "the car touched a wall, a box or another car", Group.WORLD)
NOT_STOPPED = Kind(
    "not-stopped",
    "the car still drives, it stands somewhere else than it should, or it did not stay there",
    Group.WORLD,
)
NOT_DRIVEN = Kind("not-driven", "the car got commands, but it did not drive as far as it should", Group.WORLD)

TURNED = 0.5
"""Radians by which a car's heading must change to have turned: one that comes to a stop still swings a little."""
NEARLY = 0.02
"""Metres that make no difference: a car that pushes against a wall still comes a little nearer to it."""
_THERE = 0.05
"""Metres within which a car is still at the same place."""
STANDS_FOR = 0.25
"""Seconds for which a car must stand to have stopped: one that turns back passes through a speed of 0."""


class Car(Expectations):
    """A car of the launch's world. All times are seconds of the world, which goes slower on a busy machine."""

    def __init__(self, running: RunningLaunch, namespace: str) -> None:
        """Ask about the car of this namespace.

        Raises:
            Misuse: the launch has no world, or no such car.
        """
        super().__init__(running)
        if running.world is None:
            raise Misuse('car: this launch has no world; write launch(…, world=World("room")).')
        self._world: RunningWorld = running.world
        self._name = namespace.strip("/")
        if self._name not in self._world.simulation.driven:
            known = ", ".join(f'"/{name}"' if name else '""' for name in self._world.simulation.driven)
            raise Misuse(f"car: the world has no car {namespace!r}; it has {known}.")
        self.name = f"/{self._name}/car" if self._name else "/car"

    def __repr__(self) -> str:
        pose = self.pose
        return f"car {self.name} at ({pose.x:.2f}, {pose.y:.2f}), heading {math.degrees(pose.heading):.0f}°"

    @property
    def pose(self) -> Pose:
        """Where it is: x and y in metres, heading in radians.

        Example:
            `x, y, heading = ros.car().pose`
        """
        return self._world.simulation.driven[self._name].pose

    def trail(self) -> list[Sample]:
        """Where it was after each step of 0.05 s: `time`, `pose`, `speed`, and whether the watchdog `braked`.

        Example:
            `fastest = max(sample.speed for sample in ros.car().trail())`
        """
        with self._world.simulation.lock:
            return list(self._record.trail)

    def touches(self) -> list[Touch]:
        """What it touched so far: `time`, `pose`, `what`, and where.

        Example:
            `len(ros.car().touches())`
        """
        with self._world.simulation.lock:
            return list(self._record.touches)

    def place(self, x: float, y: float, heading: float = 0.0) -> None:
        """Put it somewhere; it stands then. What it did so far stays in its record.

        Args:
            x: metres from the left edge of the map.
            y: metres from the lower edge of the map.
            heading: radians, 0 to the right, counter-clockwise.

        Example:
            `ros.car().place(1.0, 2.0)`
        """
        from autograder.world import Pose

        refused = self._world.simulation.place(self._name, Pose(float(x), float(y), float(heading)))
        if refused:
            raise Misuse(f"place: the car cannot be at ({x}, {y}): {refused}.")

    @waits_for("the car to come to its place")
    def expect_reached(self, place: str, *, within: float = 60.0, hint: str = "") -> float:
        """Its middle comes onto a place of the map, or was there before.

        Args:
            place: a name from `places:` of the map.
            within: seconds of the world, from now on.
            hint: a pointer for the student.

        Returns:
            when it came there for the first time, in seconds of the world.

        Example:
            `ros.car().expect_reached("parking", within=30)`

        Codes:
            `place-not-reached`, and those of a topic on which nothing comes.
        """
        self._refuse_place(place)
        came = self._wait_in_world(lambda: place in self._record.places, within)
        title = f"`{self.name}` reaches {place}"
        if came:
            time = self._record.places[place]
            outcomes.passed(title, observed=f"after {time:.1f} s", picture=self._picture())
            return time
        trail = self.trail()
        nearest = min(self._away(place, one) for one in trail)
        sample = next(one for one in trail if self._away(place, one) < nearest + NEARLY)
        text = f"At {sample.time:.1f} s the car was nearest to {place}: {self._away(place, sample):.2f} m from it, at "
        self._fail_with(
            title, PLACE_NOT_REACHED, text + f"{_at(sample.pose)}. {self._afterwards(sample)}", sample, hint
        )

    def expect_no_touch(self, *, hint: str = "") -> None:
        """It has not touched anything so far.

        Args:
            hint: a pointer for the student.

        Example:
            `ros.car().expect_no_touch()`

        Codes:
            `touched`.
        """
        title, touches = f"`{self.name}` touches nothing", self.touches()
        if not touches:
            outcomes.passed(title)
            return
        first = touches[0]
        more = f" It touched something {len(touches)} times in all." if len(touches) > 1 else ""
        text = f"At {first.time:.1f} s the car touched {first.what} at ({first.x:.2f}, {first.y:.2f}).{more}"
        self._fail(title, TOUCHED(text), hint=hint, picture=self._picture(self._mark(first.x, first.y, text)))

    @waits_for("the car to stand")
    def expect_stopped_within(self, seconds: float, *, at: str = "", stays: float = 0.0, hint: str = "") -> None:
        """It stands, at the latest so many seconds of the world from now.

        Args:
            seconds: from now on, until it stands; it must then go on standing for a quarter of a second.
            at: the place of the map on which it must stand; by default anywhere.
            stays: seconds of the world for which it must then go on standing, without turning on the spot.
            hint: a pointer for the student.

        Example:
            `ros.program("planner").stop(kill=True); ros.car().expect_stopped_within(1.0)`

        Codes:
            `not-stopped`.
        """
        if at:
            self._refuse_place(at)
        began = self._world.simulation.time
        deadline = began + seconds

        def stopped() -> bool:
            # Nobody drives on a car whose programs have ended, so nothing more has to be waited for.
            enough = STANDS_FOR if self._running.all_ended() else max(stays, STANDS_FOR)
            since = self._stands_since(enough, may_turn=not stays)
            return since is not None and since <= deadline and self._is_at(at)

        def too_late() -> bool:
            since = self._stands_since(0.0, may_turn=not stays)
            return self._world.simulation.time > deadline and (since is None or since > deadline or not self._is_at(at))

        where = f" on {at}" if at else ""
        title = f"`{self.name}` stands{where} within {seconds:g} s" + f", and for {stays:g} s more" * bool(stays)
        if self._wait_in_world(stopped, seconds + max(stays, STANDS_FOR) + 0.1, too_late):
            outcomes.passed(title, observed=f"at {_at(self.pose)}")
            return
        last = self.trail()[-1]
        left = self._how_its_rest_ended(at, began, deadline) if stays else ""
        self._fail_with(title, NOT_STOPPED, left or self._why_it_does_not_stand(last, at), last, hint)

    @waits_for("the car to drive")
    def expect_driven(self, metres: float, *, within: float = 30.0, hint: str = "") -> None:
        """It has driven at least so far, since the launch began.

        Args:
            metres: along its way.
            within: seconds of the world, from now on.
            hint: a pointer for the student.

        Example:
            `ros.car().expect_driven(0.5)`

        Codes:
            `not-driven`, and those of a topic on which nothing comes.
        """
        title = f"`{self.name}` drives {metres:g} m"
        if self._wait_in_world(lambda: self._record.metres >= metres, within):
            outcomes.passed(title, observed=f"{self._record.metres:.1f} m")
            return
        last = self.trail()[-1]
        turns = (_turned(one, other) for one, other in pairwise(self.trail()))
        turned = sum(turn for turn in turns if turn <= _at_most_turned())  # a check may have put it there, turned
        where = (
            f"is at {_at(last.pose)}"
            if turned < TURNED
            else (f"turned by {math.degrees(turned):.0f} degrees, at {_at(last.pose)}")
        )
        text = f"It drove {self._record.metres:.2f} m in {last.time:.1f} s, and {where}."
        self._fail_with(title, NOT_DRIVEN, f"{text} {self._afterwards(last)}".strip(), last, hint)

    @property
    def _record(self) -> Record:
        return self._world.simulation.records[self._name]

    def _wait_in_world(
        self, ready: Callable[[], bool], seconds: float, hopeless: Callable[[], bool] = lambda: False
    ) -> bool:
        """Wait until something is so or hopeless, or so many seconds of the world are over, or nothing drives it."""
        world = self._world.simulation
        deadline = world.time + seconds

        def nothing_more() -> bool:
            ended = self._running.all_ended() and self._stands_since() is not None
            return ended or world.time >= deadline or hopeless()

        return self._observer.wait(ready, 4 * seconds + 10, nothing_more)

    def _refuse_place(self, place: str) -> None:
        places = self._world.simulation.room.places
        if place not in places:
            raise Misuse(f"The map has no place {place!r}; it has {', '.join(map(repr, places)) or 'none'}.")

    def _away(self, place: str, sample: Sample) -> float:
        return self._world.simulation.room.distance_to(place, sample.pose.x, sample.pose.y)

    def _is_at(self, place: str, sample: Sample | None = None) -> bool:
        pose = sample.pose if sample else self.pose
        return not place or self._world.simulation.room.place_at(pose.x, pose.y) == place

    def _stands_since(self, enough: float = STANDS_FOR, *, may_turn: bool = True) -> float | None:
        """Since when it stands; None if it does not, or not for long enough yet."""
        trail = self.trail()
        since = None
        for sample in reversed(trail):
            if abs(sample.speed) > _stands_below() or not (may_turn or _turned(sample, trail[-1]) < TURNED):
                break
            since = sample.time
        return since if since is not None and trail[-1].time - since >= enough else None

    def _why_it_does_not_stand(self, last: Sample, at: str) -> str:
        """Say what it does at the end instead of standing on a place."""
        if abs(last.speed) > _stands_below():
            return f"At {last.time:.1f} s the car still drives with {last.speed:.2f} m/s, at {_at(last.pose)}."
        if self._is_at(at):
            return f"At {last.time:.1f} s the car had just stopped, at {_at(last.pose)}: too late."
        return f"At {last.time:.1f} s the car stands at {_at(last.pose)}, {self._away(at, last):.2f} m from {at}."

    def _how_its_rest_ended(self, at: str, began: float, deadline: float) -> str:
        """Say how it left the place on which it had stopped in time, or turned there; empty if it did not stop."""
        text, rest = "", None  # where its rest began
        for sample in (one for one in self.trail() if one.time >= began):
            drives = abs(sample.speed) > _stands_below()
            if rest is None:
                if not drives and sample.time <= deadline and self._is_at(at, sample):
                    rest = sample
            elif drives or _turned(rest, sample) >= TURNED:
                if sample.time - rest.time >= STANDS_FOR:
                    where, then = f" on {at}" if at else "", "drove on" if drives else "turned on the spot"
                    text = f"From {rest.time:.1f} s to {sample.time:.1f} s the car stood{where}, and then it {then}."
                rest = None
        return text

    def _afterwards(self, sample: Sample) -> str:
        """Why it did not drive on, as far as the record shows that."""
        if any(map(was_an_int, self._world.simulation.driven[self._name].wanted)):
            return "The last command on `cmd_vel` has an `int` where a `float` is required: write `1.0`, not `1`."
        touches = [touch for touch in self.touches() if self._is_there(touch, sample)]
        if touches:
            return f"There it touched {touches[-1].what}."
        last = self.trail()[-1]
        if last.braked and self._record.passed_over > self._world.simulation.driven[self._name].commanded:
            return f"At {last.time:.1f} s its motors brake, because the last command on `cmd_vel` was NaN or infinite."
        if last.braked:
            needs = "`cmd_vel`, or no heartbeat," if self._world.simulation.heartbeat else "`cmd_vel`"
            return f"At {last.time:.1f} s its motors brake, because nothing came on {needs} for 0.3 s."
        return ""

    def _is_there(self, touch: Touch, sample: Sample) -> bool:
        """Whether it touched something at about the time of a sample, or stayed where it did from the one to the other.

        It stays if it crawls, if it pushes on, or if a busy machine lets its motors brake there.
        """
        begin, end = sorted((touch.time, sample.time))
        between = [one.pose for one in self.trail() if begin <= one.time <= end]
        return end - begin < 1.0 or all(math.dist(pose[:2], touch.pose[:2]) < _THERE for pose in between)

    def _fail_with(self, title: str, kind: Kind, text: str, sample: Sample, hint: str) -> NoReturn:
        """Fail with the place at which it went wrong; if no command came at all, with why none came."""
        reason: Reason | None = kind(text.strip())
        if not self._record.commands:
            topic = self._world.full_name(self._name, "cmd_vel")
            reason = diagnosis.why_silent(self._scene(), topic, Twist, QoSProfile(depth=1))
        mark = self._mark(sample.pose.x, sample.pose.y, text.strip())
        self._fail(title, reason, observed="" if self._record.commands else "no command reached the car", hint=hint,
                   picture=self._picture(mark))  # fmt: skip

    def _mark(self, x: float, y: float, text: str) -> Mark:
        from autograder.world.drawing import Mark

        return Mark(x, y, text)

    def _picture(self, *marks: Mark) -> Picture:
        from autograder.world.drawing import drawn, still

        return still(drawn(self._world.simulation), marks)


def _turned(one: Sample, other: Sample) -> float:
    """The radians between two headings."""
    return abs(math.remainder(other.pose.heading - one.pose.heading, math.tau))


def _at(pose: Pose) -> str:
    return f"({pose.x:.2f}, {pose.y:.2f})"


def _at_most_turned() -> float:
    """The radians by which a car can turn in a step, and a little more."""
    from autograder.world.car import FASTEST_TURN
    from autograder.world.simulation import STEP

    return 1.1 * FASTEST_TURN * STEP


def _stands_below() -> float:
    from autograder.world.simulation import STANDS

    return STANDS
