"""The live view of a world in a notebook: a widget that is fed from a thread, so that cells go on beside it.

The widget is made with anywidget, which brings its part of JupyterLab along and loads nothing from a network. As long
as no page looks, nothing is sent. When the launch ends, the picture of the world with its trails takes the widget's
place, so that the saved notebook shows it wherever it is opened.

A notebook that is saved before that holds a widget which no other kernel knows, and for which JupyterLab shows only an
error. Therefore the picture is also a second output, below the widget, which hides it as long as it is alive.
"""

from __future__ import annotations

import contextlib
import math
import threading
import time
import uuid
from collections import deque
from collections.abc import Callable
from itertools import islice, takewhile
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from geometry_msgs.msg import Twist
from rclpy.qos import QoSProfile

from autograder.arguments.remap_rules import namespace_of
from autograder.checks.message_text import in_words, int_in_float, set_fields, shorten, was_an_int
from autograder.checks.program import Program
from autograder.graph.names import full_name
from autograder.notebook.world_extras import Buttons, Extras, ShownScan
from autograder.world import RunningWorld
from autograder.world import car as cars
from autograder.world.drawing import blocks, drawn, still, thinned
from autograder.world.room import BOX, WALL
from autograder.world.simulation import RANGE_MAX, STANDS, Sample, Touch

if TYPE_CHECKING:
    from autograder.checks.running_launch import RunningLaunch
    from autograder.graph.recording import Recording

_HERE = Path(__file__).parent
_EVERY = 0.1
"""The seconds between two messages to the page."""
_GONE_AFTER = 3.0
"""The seconds after which a page that says nothing does not look any more."""
_KEYS_HOLD = 1.0
"""The seconds for which a key counts as held if nothing more comes from the page."""
_EVERY_RAY = 6
"""Of the lidar's rays, one in so many is shown."""
_TRAIL, _APART = 3000, 0.03
"""The points of a trail that are sent to a page that begins to look, and the metres between two of them."""
_MARKS = 200
"""The marks of each kind that are shown of a car."""
_PICTURE_EVERY = 10.0
"""The seconds after which the picture for a saved notebook is drawn again while a page looks."""
_SEE_IT_LIVE = (
    "This is a picture of the world, drawn shortly before the notebook was saved. The live view belongs to the kernel "
    "in which the programs ran: to see it again, run the notebook's cells up to this one."
)
_RATES_OVER = 2.0
"""The seconds over which the rates of topics are counted."""

_Mark = TypeVar("_Mark", Sample, Touch)


class WorldView:
    """Shows one world and takes what a person does with it.

    Args:
        running: the launch, which has a world.
        extras: what the lab adds to the view.
        busy: tells whether a cell runs, while which a page may not be heard.
        checking: tells whether it is a check, during which the lab's buttons do nothing.
    """

    def __init__(
        self, running: RunningLaunch, extras: Extras, busy: Callable[[], bool], checking: Callable[[], bool]
    ) -> None:
        """Begin to show it below the running cell."""
        assert running.world is not None
        self._running, self._busy = running, busy
        self._world: RunningWorld = running.world
        self._names = list(self._world.simulation.driven)
        self._lock = threading.Lock()
        self._heard = 0.0
        self._sent = [0] * len(self._names)
        """The step up to which each car's trail has been sent."""
        self._marked = -math.inf
        """When the first step began whose marks of brakes and touches have not been sent, in the world's time."""
        self._whole = True
        self._news: list[str] = []
        self._told = _Told(running, self._world)
        self._rates = _Rates(self._world, [running.observer.record(*one) for one in extras.listen])
        self._buttons = Buttons(extras.buttons, self._tell, checking)
        self._scans = {
            name: ShownScan(running.observer, f"/{name}/{extras.scan}" if name else f"/{extras.scan}")
            for name in (self._names if extras.scan else ())
        }
        """The scans that are shown, by the car's namespace; empty for those of the world."""
        self._wheels: dict[str, Any] = {}
        """The publishers through which a page drives, by the car's namespace."""
        self._keys: tuple[str, float, float, float] | None = None
        """The car that is driven by keys, its speeds, and until when."""
        self._still_class = f"aw-still-{uuid.uuid4().hex[:12]}"
        self._drawn_at = time.monotonic()
        self._widget = self._make_widget()
        self._display: Any = None
        self._picture: Any = None
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._feed, name="world view", daemon=True)
        self._show()
        self._answer_meanwhile()
        self._thread.start()

    def close(self) -> None:
        """End the view; the picture of the world takes its place."""
        if self._over.is_set():
            return
        self._over.set()
        self._thread.join(timeout=2.0)
        with contextlib.suppress(Exception):  # the kernel may be about to end
            left = self._still()
            # A page that was loaded again does not know the output any more that is updated here: it gets the picture.
            self._widget.send({"gone": left["text/html"]})
            self._display.update(left, raw=True)
            self._picture.update({"text/plain": ""}, raw=True)

    def _make_widget(self) -> Any:
        import anywidget
        import traitlets

        class Widget(anywidget.AnyWidget):  # type: ignore[misc]
            _esm = (_HERE / "world_view.js").read_text(encoding="utf-8")
            _css = (_HERE / "world_view.css").read_text(encoding="utf-8")
            scene = traitlets.Dict().tag(sync=True)

        widget = Widget(scene=self._scene())
        widget.on_msg(lambda _, content, __: self._take(content))
        return widget

    def _show(self) -> None:
        from IPython.display import display

        made = self._widget._repr_mimebundle_()
        live = made[0] if isinstance(made, tuple) else made
        self._display = display({**live, "text/plain": "The live view of the world"}, raw=True, display_id=True)
        self._picture = display(self._instead(), raw=True, display_id=True)

    def _instead(self) -> dict[str, str]:
        """Return what a page shows if it does not show the widget."""
        still = self._still()
        html = f'<div class="{self._still_class}">{still["text/html"]}<p>{_SEE_IT_LIVE}</p></div>'
        return {"text/html": html, "text/plain": f"{still['text/plain']} {_SEE_IT_LIVE}"}

    def _still(self) -> dict[str, str]:
        picture = still(drawn(self._world.simulation))
        return {"text/html": picture.html(), "text/plain": picture.alt}

    def _scene(self) -> dict[str, Any]:
        """What does not change, and where the cars are now: a page shows them there until the first message comes."""
        world = self._world.simulation
        room = world.room
        places = [
            {"name": name, "blocks": blocks(room.floor == number, room.cell)} for number, name in enumerate(room.places)
        ]
        return {
            "cars": self._names,
            "poses": [list(car.pose) for car in world.driven.values()],
            "still": self._still_class,
            "buttons": self._buttons.words,
            "room": {
                "width": room.width,
                "height": room.height,
                "walls": blocks(room.solid == WALL, room.cell),
                "boxes": blocks(room.solid == BOX, room.cell),
                "places": places,
                "parked": [list(car.pose) for car in world.cars if not car.driven],
                "car": [cars.LENGTH, cars.WIDTH],
            },
        }

    # What a person does. A page's messages come in the kernel's threads.

    def _take(self, content: dict[str, Any]) -> None:
        """Do what a button or a key asks for. It comes from the student's own page, so it is trusted."""
        self._heard = time.monotonic()
        name = self._names[int(content.get("car", 0))]
        match content.get("do"):
            case "begin":
                self._whole = True
            case "pause":
                self._world.paused = not self._world.paused
                self._tell("The world is paused." if self._world.paused else "The world goes on.")
            case "reset":
                for one in self._names:
                    self._world.simulation.reset(one)
                self._tell("The cars are back at their starts.")
            case "drive":
                self._drive(name, float(content["speed"]), float(content["turn"]))
            case "kill":
                self._kill(str(content["name"]))
            case "press":
                self._buttons.press(str(content["name"]))

    def _drive(self, name: str, speed: float, turn: float) -> None:
        """Drive as the keys say, until they say something else or nothing more comes."""
        drives = bool(speed or turn)
        self._keys = (name, speed, turn, time.monotonic() + _KEYS_HOLD) if drives else None
        self._command(name, speed, turn)

    def _hold_keys(self) -> None:
        """Repeat the last command: a busy browser sends fewer than the watchdog of the car wants."""
        keys = self._keys
        if keys is not None:
            name, speed, turn, until = keys
            if time.monotonic() > until:
                self._keys, speed, turn = None, 0.0, 0.0
            self._command(name, speed, turn)

    def _command(self, name: str, speed: float, turn: float) -> None:
        message = Twist()
        message.linear.x, message.angular.z = speed, turn
        with self._lock:
            if name not in self._wheels:
                topic = self._world.full_name(name, "cmd_vel")
                self._wheels[name] = self._running.observer.publisher(topic, Twist, QoSProfile(depth=1))
            self._wheels[name].publish(message)

    def _kill(self, name: str) -> None:
        for described, program in list(self._running.programs):
            if name_of(described) == name and program.running():
                self._running.may_end.append(program)
                self._running.stopped.append(program)
                program.stop(grace=0.0)

    def _tell(self, sentence: str) -> None:
        with self._lock:
            self._news.append(sentence)

    # What is shown, in the view's own thread.

    def _feed(self) -> None:
        while not self._over.wait(_EVERY):
            self._hold_keys()
            if self._heard and self._busy():  # a page that looked when the cell began may be unable to say so now
                self._heard = time.monotonic()
            if time.monotonic() - self._heard > _GONE_AFTER:
                self._heard = 0.0
                continue
            with contextlib.suppress(Exception):  # a view that breaks must not end the kernel's other threads
                self._widget.send(self._message())
                self._answer_meanwhile()
                if time.monotonic() - self._drawn_at > _PICTURE_EVERY:
                    self._drawn_at = time.monotonic()
                    self._picture.update(self._instead(), raw=True)

    def _answer_meanwhile(self) -> None:
        """Let the page's messages be dealt with while a cell runs.

        JupyterLab sends them to a subshell of the kernel, but ipykernel leads them to the one that has sent something
        last, which is the main shell, and that waits for the cell. Without this note it does not; where ipykernel has
        no such note, buttons take effect when the cell ends.
        """
        vars(self._widget.comm).pop("_reply_subshell_id", None)

    def _message(self) -> dict[str, Any]:
        whole, self._whole = self._whole, False
        with self._lock:
            news, self._news = self._news + self._told.news(), []
        world = self._world.simulation
        with world.lock:
            shown = [self._car(number, name, whole) for number, name in enumerate(self._names)]
            since, self._marked = -math.inf if whole else self._marked, world.time
            touches = [[round(one.x, 2), round(one.y, 2)] for record in world.records.values()
                       for one in _after(since, record.touches)]  # fmt: skip
            brakes = [[round(one.pose.x, 2), round(one.pose.y, 2)] for record in world.records.values()
                      for one in _after(since, record.brakes)]  # fmt: skip
        return {
            "whole": whole,
            "cars": shown,
            "touches": touches,
            "brakes": brakes,
            "rates": self._rates.now(),
            "running": self._programs(),
            "paused": self._world.paused,
            "news": news,
        }

    def _programs(self) -> dict[str, bool]:
        """Return whether each program runs; one that was started again runs if its last run does."""
        return {name_of(described): program.running() for described, program in list(self._running.programs)}

    def _car(self, number: int, name: str, whole: bool) -> dict[str, Any]:
        world = self._world.simulation
        car, trail = world.driven[name], world.records[name].trail
        new = len(trail) if whole else min(len(trail), world.steps - self._sent[number])
        self._sent[number] = world.steps
        since = max(
            0, len(trail) - new - 1
        )  # with the last one that was sent, from which the car may have been put away
        points = thinned([sample.pose for sample in islice(trail, since, None)], _APART)[-_TRAIL:]
        ends = [
            [round(car.pose.x + metres * math.cos(car.pose.heading + angle), 2),
             round(car.pose.y + metres * math.sin(car.pose.heading + angle), 2)]
            for angle, metres in self._seen(name)
        ]  # fmt: skip
        return {
            "pose": [round(value, 3) for value in car.pose],
            "speed": round(car.speed, 2),
            "state": _state(car, world.missing(car)),
            "trail": [[round(pose.x, 2), round(pose.y, 2), jumped] for pose, jumped in points],
            "rays": ends,
        }

    def _seen(self, name: str) -> list[tuple[float, float]]:
        """Return the directions and the metres of the rays that are shown of a car."""
        if self._scans:
            return self._scans[name].rays(_EVERY_RAY)
        world = self._world.simulation
        metres = (min(float(one), RANGE_MAX) for one in world.scan(name)[::_EVERY_RAY])
        return list(zip(map(float, world.angles[::_EVERY_RAY]), metres, strict=True))


def _after(time: float, marks: deque[_Mark]) -> list[_Mark]:
    """Return the last marks of the step that begins at a time of the world, and of those after it."""
    return list(islice(takewhile(lambda one: one.time >= time, reversed(marks)), _MARKS))[::-1]


def name_of(described: Program) -> str:
    """Return what a program is called in the view: the full name of its node, as far as the launch gives it."""
    space, name = namespace_of(described.all_rules()), described.node_name() or described.program
    return full_name(space, name) if space else name


def _state(car: cars.Car, missing: str) -> str:
    if car.touches:
        return f"touches {car.touches}"
    if any(map(was_an_int, car.wanted)):
        return "got an int, not a float: write 1.0 for 1"
    return f"brakes: no {missing}" if missing else ""


class _Told:
    """What has happened since it was asked last, a sentence each."""

    def __init__(self, running: RunningLaunch, world: RunningWorld) -> None:
        self._running, self._world = running, world
        self._touches = {name: len(record.touches) for name, record in world.simulation.records.items()}
        self._places = {name: len(record.places) for name, record in world.simulation.records.items()}
        self._moves = dict.fromkeys(world.simulation.records, False)
        self._held_up = {name: bool(record.brakes) for name, record in world.simulation.records.items()}
        self._ended: set[int] = set()

    def news(self) -> list[str]:
        """Return the sentences."""
        found = []
        for name, record in self._world.simulation.records.items():
            car = f"The car /{name}" if len(self._moves) > 1 else "The car"
            for touch in list(record.touches)[self._touches[name] :]:
                found.append(f"{car} touches {touch.what} at ({touch.x:.1f}, {touch.y:.1f}).")
            for place in list(record.places)[self._places[name] :]:
                found.append(f"{car} has reached {place}, after {record.places[place]:.1f} s.")
            self._touches[name], self._places[name] = len(record.touches), len(record.places)
            if record.brakes and not self._held_up[name]:  # it may happen twice a second, so it is told once
                self._held_up[name] = True
                found.append(f"{car} was braked by its motors. A square marks each place where that happens.")
            trail: list[Sample] = list(record.trail)[-10:]
            moves = any(abs(sample.speed) > STANDS for sample in trail)
            if trail and moves != self._moves[name]:
                pose = trail[-1].pose
                where = f"({pose.x:.1f}, {pose.y:.1f})"
                found.append(f"{car} drives, from {where}." if moves else f"{car} stands at {where}.")
                self._moves[name] = moves
        for number, (described, program) in enumerate(self._running.programs):
            if not program.running() and number not in self._ended:
                self._ended.add(number)
                found.append(f"The program {name_of(described)} has ended.")
        return found


class _Rates:
    """How many messages a second came and went on each topic of the cars, and on further ones, with their last."""

    def __init__(self, world: RunningWorld, further: list[Recording]) -> None:
        self._world, self._further = world, further
        self._since = time.monotonic()
        self._before = self._counts()
        self._rates = dict.fromkeys(self._before, 0.0)

    def _counts(self) -> dict[str, int]:
        return {recording.topic: recording.count for recording in self._further} | {
            self._world.full_name(name, topic): count
            for name, node in self._world.nodes.items()
            for topic, count in node.counts.items()
        }

    def now(self) -> list[tuple[str, float, str]]:
        """Return the topics with their rates, over the last two seconds, and the last message of further ones."""
        passed = time.monotonic() - self._since
        if passed >= _RATES_OVER:
            counts = self._counts()
            self._rates = {topic: (count - self._before[topic]) / passed for topic, count in counts.items()}
            self._before, self._since = counts, time.monotonic()
        said = {one.topic: _said(one.messages[-1].msg) for one in self._further if one.count}
        return [(topic, rate, said.get(topic, "")) for topic, rate in self._rates.items()]


def _said(message: Any) -> str:
    said = shorten(in_words(message) if hasattr(message, "data") else set_fields(message))
    return f"{said} (an int, not a float: write 1.0 for 1)" if int_in_float(message) else said
