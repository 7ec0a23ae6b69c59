"""The world that a launch drives in: how a check cell describes it, and how it is started beside the programs.

It runs in the process of the check, outside of the sandbox of the programs, and only there are its room, its cars and
its record. What a check asks about a car is therefore what the world itself measured: a program that publishes `odom`
or `scan` of its own deceives only those who listen to them, and `told_by_others` flags it for the instructor. In a
check, nobody but the check can place a car.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from autograder.checks import current
from autograder.checks.misuse import Misuse, refuse_text
from autograder.core.errors import KitError
from autograder.graph.names import node_of

if TYPE_CHECKING:  # loads numpy, which most labs do not need
    from autograder.graph.observer import Observer
    from autograder.world import RunningWorld


@dataclass(frozen=True)
class World:
    """A room, and the cars in it that are driven.

    Attributes:
        room: one of the kit's rooms, such as `room`, or a file that a cell of the lab writes, such as `garage.yaml`; a
            map that a check draws is given as the text of such a file.
        cars: the namespaces of the cars, such as `/front`, in the order in which the map has its arrows.
        heartbeat: whether the motors also need a message on `heartbeat` (`std_msgs/Empty`) every 0.3 s.
        remappings: rules for the names of the cars, such as `("cmd_vel", "control/command")`; the first match wins.
        patient: whether the world waits for programs that are late with a command, so that a car does not drive
            blindly on a slow machine.
        boxes: whether the boxes of the map are there; without them, a check sees what a car would do that a box holds.
    """

    room: str = "room"
    cars: Sequence[str] = ("",)
    heartbeat: bool = False
    remappings: Sequence[tuple[str, str]] = ()
    patient: bool = False
    boxes: bool = True

    def __post_init__(self) -> None:
        refuse_text("World", cars=self.cars, remappings=self.remappings)
        if not self.cars or any(name and not name.startswith("/") for name in self.cars):
            raise Misuse(f"World: cars={self.cars!r} are no namespaces; write them as in ['/front', '/rear'].")

    def start(self, domain_id: int) -> RunningWorld:
        """Start it.

        Args:
            domain_id: the domain of the launch.

        Raises:
            Misuse: there is no such room, or it has fewer cars.
        """
        from autograder.world import RunningWorld, Simulation, read_room, room_from

        try:
            drawn = "\n" in self.room
            room = room_from(self.room, "of this check") if drawn else read_room(self.room, current.check.folder)
            names = [name.strip("/") for name in self.cars]
            room = room if self.boxes else room.without_boxes()
            simulation = Simulation(
                room, names, heartbeat=self.heartbeat, seed=current.check.random.getrandbits(32)
            )  # fmt: skip
        except KitError as error:
            raise Misuse(f"World: {error.what} {error.do}") from None
        except ValueError as error:
            raise Misuse(f"World: {error}.") from None
        here = current.check.front_end
        rules = [word for old, new in self.remappings for word in ("-r", f"{old}:={new}")]
        # The rules are the whole command line of the nodes, so that they do not take those of this process.
        return RunningWorld(
            simulation, domain_id, closed=here is None or here.scored, patient=self.patient,
            arguments=["--ros-args", *rules],
        )  # fmt: skip


def told_by_others(world: RunningWorld, observer: Observer) -> list[str]:
    """Return a sentence for each topic of a car on which another node publishes, as if it were the world."""
    found = []
    for name, car in world.nodes.items():
        for topic in ("odom", "scan", "camera/image_raw", "battery_state"):
            full = world.full_name(name, topic)
            others = [end for end in observer.publishers(full) if node_of(end) != car.node.get_fully_qualified_name()]
            twice = len(observer.publishers(full)) - len(others) > 1
            if others or twice:
                who = ", ".join(sorted({node_of(end) for end in others})) or f"a node named {car.node.get_name()}"
                found.append(f"{who} publishes on {full}, which is the world's; the check asked the world itself.")
    return found
