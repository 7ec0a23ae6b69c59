"""The messages on the sockets. Each is one packet of JSON, which may be accompanied by descriptors.

To the launcher, with one end of another SOCK_SEQPACKET pair, on which the first process of the new launch answers:
    {"namespaces", "disk", "inodes", "limits", "filter", "program_filter"}
To a first process, with the descriptors for output, events and stacks:
    {"id", "path", "folder", "args", "env", "cpus", "cores", "assume_success"}
From a first process: {"first": true} with its pidfd, {"ready": true} or {"broken": why}, {"started": id} with a pidfd,
    {"failed": id, "why"}, {"ended": id, "status"}.
"""

import contextlib
import json
import os
import socket
from typing import Any


class Launch:
    """A requested launch, and the socket on which its first process answers."""

    def __init__(self, packet: bytes, channel: socket.socket) -> None:
        """Read the request.

        Raises:
            KeyError: the request is incomplete.
        """
        request = json.loads(packet)
        self.channel = channel
        self.namespaces: bool = request["namespaces"]
        self.disk: int = request["disk"]
        self.inodes: int = request["inodes"]
        self.limits: dict[str, int] = request["limits"]
        self.filter = bytes.fromhex(request["filter"])
        self.program_filter = bytes.fromhex(request["program_filter"])


class Start:
    """A program whose start was requested, and the descriptors that came with the request."""

    def __init__(self, packet: bytes, descriptors: list[int], launch: Launch) -> None:
        """Read the request. Other values are those of the whole launch.

        Raises:
            KeyError: the request is incomplete.
        """
        request = json.loads(packet)
        self.id: int = request["id"]
        self.path: str = request["path"]
        self.folder: str = request["folder"]
        self.args: list[str] = request["args"]
        self.env: dict[str, str] = request["env"]
        self.cpus: list[int] = request["cpus"]
        self.cores: int = request["cores"]
        self.assume_success: bool = request["assume_success"]
        self.limits = launch.limits
        self.filter = launch.program_filter
        # Whether the program's memory and settings in /proc are hidden from the other programs of the launch. Without
        # namespaces they cannot be hidden, because the process that measures its memory has no more rights than they.
        self.hidden = launch.namespaces
        self.output, self.events, self.stacks = descriptors


def answer(channel: socket.socket, said: dict[str, Any]) -> None:
    """Send an answer. If nobody receives answers any more, end this process."""
    try:
        channel.send(json.dumps(said).encode())
    except OSError:
        os._exit(0)


def hand_over(channel: socket.socket, said: dict[str, Any], handle: int) -> None:
    """Send an answer with a pidfd, if the kernel accepts it, and close the pidfd."""
    with contextlib.suppress(OSError):
        socket.send_fds(channel, [json.dumps(said).encode()], [handle])
    os.close(handle)
