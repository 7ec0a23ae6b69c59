"""The command `autograder world`, which runs a world as a program of its own."""

from __future__ import annotations

import signal
import threading
from typing import Annotated

import typer

from autograder.cli.app import app


@app.command(context_settings={"ignore_unknown_options": True})
def world(
    room: Annotated[str, typer.Argument(help="A room of the kit, such as `room`, or a file that ends with .yaml.")],
    car: Annotated[list[str] | None, typer.Option(help="The namespace of a car; once for each car.")] = None,
    heartbeat: Annotated[bool, typer.Option(help="The motors also need a message on `heartbeat`.")] = False,
    seed: Annotated[int, typer.Option(help="The seed of the lidar's noise.")] = 0,
    words: Annotated[
        list[str] | None, typer.Argument(metavar="[--ros-args ...]", help="ROS arguments, such as remap rules.")
    ] = None,
) -> None:
    """Run a world with a car until Ctrl-C, as a ROS node that others can drive."""
    from rclpy.exceptions import NameValidationException

    from autograder.core.errors import KitError
    from autograder.world import RunningWorld, Simulation, read_room

    given = words or []
    before = given[: given.index("--ros-args")] if "--ros-args" in given else given
    if before:
        raise KitError(f"The world has no option or argument `{before[0]}`.", "See `autograder world --help`.")
    names = [name.strip("/") for name in car or [""]]
    try:
        simulation = Simulation(read_room(room), names, heartbeat=heartbeat, seed=seed)
    except ValueError as error:
        raise KitError(f"The world does not start: {error}.", "Name fewer cars, or draw more arrows.") from None
    over = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):  # an exception while the nodes are made would leave some behind
        signal.signal(number, lambda *_: over.set())
    try:
        running = RunningWorld(simulation, arguments=given)
    except (RuntimeError, NameValidationException) as error:  # rclpy's errors are RuntimeErrors
        reason = " ".join(str(error).split())
        raise KitError(
            f"The world does not start: {reason}.",
            "Look at the names, at the ROS arguments (a remap rule is `-r FROM:=TO`), and at ROS_DOMAIN_ID.",
        ) from None
    nodes = ", ".join(node.node.get_fully_qualified_name() for node in running.nodes.values())
    typer.echo(f"The world {room} runs with {nodes}. Ctrl-C ends it.")
    over.wait()
    running.close()
