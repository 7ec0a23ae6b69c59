"""Notebooks and their kernels, driven as a front end drives them."""

from __future__ import annotations

import json
import os
import tempfile
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from jupyter_client.blocking import BlockingKernelClient
from jupyter_client.manager import KernelManager
from traitlets.config import Config

START = 180
"""Far beyond what a kernel, or a cell, takes on a busy machine, in seconds."""


def own_sockets() -> Config:
    """The settings of a kernel that uses files and no ports.

    Ports would be chosen before the kernel starts, and another program could take one of them in the meantime.
    """
    return Config({"KernelManager": {"transport": "ipc", "ip": f"{tempfile.mkdtemp(prefix='kernel-')}/socket"}})


@dataclass
class Shown:
    """What a cell showed."""

    text: str = ""
    """Streams and plain text, in order."""
    html: str = ""
    result: str = ""
    """The plain text of the cell's value, which nbgrader reads."""
    error: str = ""
    types: list[str] = field(default_factory=list)
    seconds: float = 0.0
    number: int = 0
    """In the brackets beside the cell."""


class Notebook:
    """A notebook on disk and its kernel, started as a Jupyter server starts one."""

    def __init__(self, place: Path, name: str = "lab", **environment: str) -> None:
        self.path = place / f"{name}.ipynb"
        self.save()
        self._manager = KernelManager(kernel_name="python3", config=own_sockets())
        self._manager.start_kernel(
            cwd=str(place), env={**os.environ, "JPY_SESSION_NAME": str(self.path), **environment}
        )
        self._connect()

    def _connect(self) -> None:
        self._client = self._manager.client()
        self._client.start_channels()
        self._client.wait_for_ready(timeout=START)
        # A cell may run in another thread while a test asks a subshell, and neither ZeroMQ's sockets nor a session
        # may be used by two threads. A page of JupyterLab has one thread.
        self._beside = BlockingKernelClient()
        self._beside.load_connection_file(self._manager.connection_file)
        self._beside.start_channels(iopub=False, stdin=False, hb=False)

    def _disconnect(self) -> None:
        self._beside.stop_channels()
        self._client.stop_channels()

    def save(self, *cells: tuple[str, str, dict[str, Any]], answers: dict[str, str] | None = None) -> None:
        """Save cells: id, source, metadata; and the answers' files by grade_id, as a released notebook says them."""
        made = [
            {"cell_type": "code", "id": i, "source": s, "metadata": m, "outputs": [], "execution_count": None}
            for i, s, m in cells
        ]
        metadata = {"autograder": {"answers": answers}} if answers else {}
        self.path.write_text(json.dumps({"cells": made, "metadata": metadata, "nbformat": 4, "nbformat_minor": 5}))

    def run(self, source: str, cell_id: str = "", interrupt_after: float | None = None) -> Shown:
        """Run a cell, and interrupt it once so many seconds after it was sent, if it runs that long."""
        began = time.monotonic()
        content = {"code": source, "silent": False, "store_history": True, "user_expressions": {}}
        request = self._client.session.msg("execute_request", content | {"allow_stdin": False, "stop_on_error": False})
        request["metadata"] = {"cellId": cell_id} if cell_id else {}
        self._client.shell_channel.send(request)
        shown = Shown()
        interrupt = threading.Timer(interrupt_after or 0.0, self._manager.interrupt_kernel)
        if interrupt_after is not None:
            interrupt.start()
        while True:
            message = self._client.get_iopub_msg(timeout=START)
            if message["parent_header"].get("msg_id") != request["header"]["msg_id"]:
                continue
            content, kind = message["content"], message["msg_type"]
            if kind == "status" and content["execution_state"] == "idle":
                shown.seconds = time.monotonic() - began
                interrupt.cancel()
                if interrupt_after is not None:
                    interrupt.join()
                return shown
            shown.types.append(kind)
            if kind == "execute_input":
                shown.number = content["execution_count"]
            if kind == "stream":
                shown.text += content["text"]
            elif kind == "error":
                shown.error = "\n".join(content["traceback"])
            elif "data" in content:
                shown.text += content["data"].get("text/plain", "") + "\n"
                shown.html += content["data"].get("text/html", "")
                if kind == "execute_result":
                    shown.result = content["data"]["text/plain"]

    def open_subshell(self) -> str:
        """Open a subshell, as JupyterLab does for what widgets say, and return its id."""
        request = self._beside.session.msg("create_subshell_request", {})
        self._beside.control_channel.send(request)
        while True:
            reply = self._beside.get_control_msg(timeout=START)
            if reply["parent_header"].get("msg_id") == request["header"]["msg_id"]:
                return str(reply["content"]["subshell_id"])

    def ask(self, subshell: str) -> None:
        """Let a subshell answer a request, and wait until it has; a cell may run meanwhile."""
        for _ in range(2):  # the first has been dealt with in full once the second is answered
            request = self._beside.session.msg("kernel_info_request", {})
            request["header"]["subshell_id"] = subshell
            self._beside.shell_channel.send(request)
            while True:
                reply = self._beside.get_shell_msg(timeout=START)
                if reply["parent_header"].get("msg_id") == request["header"]["msg_id"]:
                    break

    def tell_widget(self, comm: str, content: dict[str, Any], subshell: str) -> None:
        """Send a widget's comm what a page sends when somebody presses a button; a cell may run meanwhile."""
        data = {"method": "custom", "content": content}
        message = self._beside.session.msg("comm_msg", {"comm_id": comm, "data": data})
        message["header"]["subshell_id"] = subshell
        self._beside.shell_channel.send(message)

    def interrupt(self) -> None:
        self._manager.interrupt_kernel()

    def restart(self) -> None:
        self._disconnect()
        self._manager.restart_kernel(now=True)
        self._connect()

    def close(self) -> None:
        self._disconnect()
        self._manager.shutdown_kernel()


TALKER = """%%node talker
import rclpy
from rclpy.node import Node
from std_msgs.msg import String


class Talker(Node):
    def __init__(self):
        super().__init__("talker")
        self.publisher = self.create_publisher(String, "chatter", 10)
        self.create_timer(0.05, self.tick)

    def tick(self):
        print("\\x1b[32mtick\\x1b[0m <b>")
        self.publisher.publish(String(data="hello"))


rclpy.init()
rclpy.spin(Talker())
"""
SET_UP = "%load_ext autograder\nfrom autograder.checks import launch\nfrom std_msgs.msg import String"
