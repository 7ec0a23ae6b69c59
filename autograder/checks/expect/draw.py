"""`ros.draw`: pictures of who ran when, who talks to whom, which state, which match, which arrival. No outcomes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from autograder import pictures
from autograder.checks import picture_data
from autograder.checks.expect.expectations import Expectations
from autograder.checks.misuse import Misuse
from autograder.pictures import Picture

if TYPE_CHECKING:  # loads numpy, which most labs do not need
    from autograder.world.drawing import Drawn

_MOST_FRAMES = 12


class Draw(Expectations):
    """What happened in this launch, drawn. Each picture can also be asked for after the block."""

    def timeline(self, *callbacks: str, seconds: float | None = None, by: str = "callback") -> Picture:
        """A picture of when each callback ran, on which thread, in which callback group.

        Args:
            callbacks: names of those to draw; by default all.
            seconds: how much of it; by default all, and not more than 4 s.
            by: `callback`, a row for each callback, or `thread`, a row for each thread.

        Example:
            `ros.draw.timeline(seconds=2)`
        """
        return pictures.timeline(picture_data.runs(self._insides()).of(*callbacks), seconds=seconds, by=by)

    def graph(self) -> Picture:
        """A picture of the nodes and topics, with the quality of service of each end: now, or as it was at the end.

        Example:
            `ros.draw.graph()`
        """
        found = self._running.graph or picture_data.graph(self._observer)
        return pictures.graph(found.nodes, found.endpoints, picture_data.mismatch)

    def qos(self, topic: str = "") -> Picture:
        """A picture of which publishers and subscriptions of a topic match, and over which policy they do not.

        Args:
            topic: full name; without it, the sentence of the refusal names the topics that there are.

        Example:
            `ros.draw.qos("/frames")`
        """
        found = self._running.graph or picture_data.graph(self._observer)
        _refuse_unnamed("qos", topic, [end.topic for end in found.endpoints])
        return pictures.qos(topic, [end for end in found.endpoints if end.topic == topic], picture_data.mismatch)

    def lifecycle(self, node: str) -> Picture:
        """A picture of the state machine, with the way that a node took through it.

        Args:
            node: full name of a lifecycle node; the launch must have watched it for the way that it took, as
                `launch(..., lifecycle=[node])` does from the start.

        Example:
            `ros.draw.lifecycle("/camera")`
        """
        client = self._running.lifecycle_clients.get(node)
        changes = [change.step for change in client.changes] if client else []
        if not changes and (client is None or self._running.graph is not None):
            self._refuse_ordinary(node)
        return pictures.lifecycle(node, pictures.steps(changes))

    def _refuse_ordinary(self, node: str) -> None:
        """Refuse to draw a state machine that a node does not have.

        Raises:
            Misuse: it is no lifecycle node.
        """
        found = self._running.graph or picture_data.graph(self._observer)
        if node in found.lifecycle:
            return
        if node not in found.nodes:
            raise Misuse(f"lifecycle: there is no node `{node}`; there are {', '.join(found.nodes) or 'none'}.")
        raise Misuse(
            f"lifecycle: `{node}` is no lifecycle node but an ordinary one, which has no states to draw: it offers no "
            f"service `{node}/get_state`."
        )

    def arrivals(self, topic: str = "", *, seconds: float | None = None) -> Picture:
        """A picture of when each message of a topic was published, and when each subscription's callback got one.

        Args:
            topic: full name; without it, the sentence of the refusal names the topics that there are.
            seconds: how much of it; by default all.

        Example:
            `ros.draw.arrivals("/frames")`
        """
        if not topic:  # only then is the graph asked, of which an ended launch of grading keeps nothing
            found = self._running.graph or picture_data.graph(self._observer)
            _refuse_unnamed("arrivals", topic, [end.topic for end in found.endpoints])
        return pictures.arrivals(topic, picture_data.traffic(self._insides(), topic), seconds=seconds)

    def world(self) -> Picture:
        """A picture of the world with the trails of its cars: now, or as it was at the end.

        Example:
            `ros.draw.world()`
        """
        from autograder.world.drawing import still

        return still(self._drawn("world"))

    def film(self, frames: int = 6, *, seconds: float | None = None) -> Picture:
        """A film strip: moments of the world from the beginning to the end, one beside the other.

        Args:
            frames: how many.
            seconds: only the last of it, in seconds of the world; by default all.

        Example:
            `ros.draw.film(frames=6)`
        """
        from autograder.world.drawing import strip

        if not 2 <= frames <= _MOST_FRAMES:
            raise Misuse(f"film: frames={frames!r} is no number from 2 to {_MOST_FRAMES}.")
        if seconds is not None and not seconds > 0:
            raise Misuse(f"film: seconds={seconds!r} is not above 0.")
        return strip(self._drawn("film"), frames, seconds)

    def _drawn(self, picture: str) -> Drawn:
        from autograder.world.drawing import drawn

        if self._running.world is None:
            raise Misuse(f'{picture}: this launch has no world; write launch(…, world=World("room")).')
        return drawn(self._running.world.simulation)


def _refuse_unnamed(picture: str, topic: str, there: Iterable[str]) -> None:
    """Ask for the topic of a picture that is about one.

    Raises:
        Misuse: none was named.
    """
    if not topic:
        known = ", ".join(f'"{name}"' for name in sorted(set(there))) or "none so far"
        raise Misuse(f'{picture}: it is about one topic, such as ros.draw.{picture}("/chatter"). Topics here: {known}.')
