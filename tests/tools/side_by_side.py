"""Runs many notebooks side by side, of several users, and notes every name that a launch saw and that was not its own.

`python tests/tools/side_by_side.py` runs 20 kernels, each with the solution of a lab, all labs; as root of four users,
else of one. Meanwhile each user has a program in a terminal that goes from domain to domain, and kernels that are
killed while their robots run. Exit status 1 if anybody heard anybody else, or a cell of a solution failed.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent / "support"))
SOLUTIONS = HERE.parents[1] / "solutions"
USERS = (12001, 12002, 12003, 12004)
LOOK = 0.25
"""Seconds between two looks at what an observer sees."""

TERMINAL = """
import os, random, sys, time
import rclpy
from std_msgs.msg import String
while True:
    rclpy.init(domain_id=random.randrange(1, 101))
    node = rclpy.create_node(f"terminal_{os.getuid()}")
    publisher = node.create_publisher(String, f"/terminal_{os.getuid()}", 10)
    end = time.monotonic() + 5
    while time.monotonic() < end:
        publisher.publish(String(data="hello"))
        time.sleep(0.1)
    node.destroy_node()
    rclpy.shutdown()
"""
TALKER = """%%node talker
import rclpy
from rclpy.node import Node
rclpy.init()
rclpy.spin(Node("killed"))
"""
START = 'from autograder.checks import launch\nlaunch("talker").start()'


# In a kernel.


def record(out: str, domains: int = 0) -> None:
    """Note which participants the observers of this kernel see, and whether these are of its own launch.

    A participant is told by the process id that Fast DDS writes into its GUID.

    Args:
        out: file to which a line is added for each observer.
        domains: how many there are to be on this machine; 0 for as many as there are.
    """
    from autograder.graph import domains as module
    from autograder.graph.observer import Observer
    from autograder.sandbox.running_programs import RunningPrograms

    if domains:
        module.LAST = domains
    programs: list[Any] = []
    begin, close, start = Observer.__init__, Observer.close, RunningPrograms.start

    def started(group: RunningPrograms, *arguments: Any, **more: Any) -> Any:
        programs.append(start(group, *arguments, **more))
        return programs[-1]

    def begun(observer: Any, *arguments: Any, **more: Any) -> None:
        begin(observer, *arguments, **more)
        observer.sightings, observer.over = {}, threading.Event()
        observer.looking = threading.Thread(target=look_on, args=(observer,), daemon=True)
        observer.looking.start()

    def look_on(observer: Any) -> None:
        while not observer.over.wait(LOOK):
            look(observer)

    def look(observer: Any) -> None:
        node = observer.node
        with contextlib.suppress(Exception):  # a graph with forged names cannot be read
            for topic, _ in node.get_topic_names_and_types():
                for end in [*node.get_publishers_info_by_topic(topic), *node.get_subscriptions_info_by_topic(topic)]:
                    pid = int.from_bytes(bytes(end.endpoint_gid)[4:6], "little")
                    observer.sightings.setdefault(pid, set()).update((end.node_name, topic))

    def closed(observer: Any) -> None:
        if not observer.over.is_set():
            observer.over.set()
            observer.looking.join()
            look(observer)
            own = {pid & 0xFFFF for pid in (os.getpid(), *(program.pid for program in programs))}
            seen = {pid: sorted(names) for pid, names in observer.sightings.items()}
            foreign = {pid: names for pid, names in seen.items() if pid not in own}
            with Path(out).open("a") as file:
                file.write(json.dumps({"domain": observer.domain_id, "own": len(seen), "foreign": foreign}) + "\n")
        close(observer)

    Observer.__init__, Observer.close = begun, closed  # type: ignore[method-assign]
    RunningPrograms.start = started  # type: ignore[method-assign]


# As a user.


def cell(source: str) -> Any:
    """A cell of a notebook."""
    import nbformat

    return nbformat.v4.new_code_cell(source)


async def run_notebook(path: Path, domains: int, only: str) -> None:
    """Run a notebook in a kernel of its own, and write `cells.json` beside it: what went wrong.

    Args:
        path: the notebook; what launches saw is written beside it, too.
        domains: as in `record`.
        only: a pattern for the ids of the cells that are run; empty for all.
    """
    import nbformat
    from kernels import own_sockets
    from nbclient import NotebookClient

    notebook = nbformat.read(path, as_version=4)
    notebook.cells = [one for one in notebook.cells if re.search(only, one.id)]
    recorder = f"import sys; sys.path.append({str(HERE)!r}); import side_by_side"
    recorder += f"; side_by_side.record({str(path.parent / 'seen.jsonl')!r}, {domains})"
    notebook.cells.insert(0, cell(recorder))
    client = NotebookClient(
        notebook, timeout=None, startup_timeout=600, allow_errors=True, kernel_name="python3",
        config=own_sockets(), resources={"metadata": {"path": path.parent}},
    )  # fmt: skip
    await client.async_execute(env={**os.environ, "JPY_SESSION_NAME": str(path)})
    wrong = []
    for one in notebook.cells:
        for output in one.get("outputs", []):
            if output.output_type == "error":
                wrong.append(f"{one.id}: {output.ename}: {output.evalue}")
            said = str(output.get("data", {}).get("text/html", ""))
            if one.metadata.get("nbgrader", {}).get("points") and "✗" in said:
                wrong.append(f"{one.id}: {re.sub('<[^>]*>', ' ', said)[:300]}")
    (path.parent / "cells.json").write_text(json.dumps({"ran": len(notebook.cells), "wrong": wrong}))


async def kill_kernels(folder: Path, over: Callable[[], bool]) -> None:
    """Start kernels with a robot, and kill each in the midst of it."""
    from jupyter_client.manager import AsyncKernelManager
    from kernels import own_sockets

    folder.mkdir()
    while not over():
        manager = AsyncKernelManager(kernel_name="python3", config=own_sockets())
        await manager.start_kernel(cwd=str(folder))
        client = manager.client()
        client.start_channels()
        await client.wait_for_ready(timeout=600)
        for source in ("%load_ext autograder", TALKER, START):
            await client.execute_interactive(source, output_hook=lambda _: None)
        await manager.shutdown_kernel(now=True)
        client.stop_channels()


async def run_user(folder: Path, domains: int, only: str, disturbed: bool) -> None:
    """Run all notebooks below a folder at the same time."""
    running = [asyncio.create_task(run_notebook(path, domains, only)) for path in sorted(folder.glob("*/*.ipynb"))]
    tasks = [*running]
    if disturbed:
        tasks.append(asyncio.create_task(kill_kernels(folder / "killed", lambda: all(one.done() for one in running))))
    await asyncio.gather(*tasks)


# Over all users.


@dataclass
class Seen:
    """What was seen in one notebook."""

    name: str
    launches: int = 0
    foreign: list[str] = field(default_factory=list)
    """Names that were not of its own launch."""
    cells: int = 0
    wrong: list[str] = field(default_factory=list)
    """Cells that did not come out as they should."""


def as_user(user: int) -> list[str]:
    """Begin a command line with this, to be another user who may still read where root's Python lies.

    CMake asks with access(2), which knows of no such right: lab 7 needs a Python in folders that everybody may enter.
    """
    caps = ["--inh-caps=+dac_read_search", "--ambient-caps=+dac_read_search"]
    return ["setpriv", f"--reuid={user}", f"--regid={user}", "--clear-groups", *caps] if os.getuid() == 0 else []


@contextlib.contextmanager
def terminal(user: int, environment: dict[str, str]) -> Iterator[None]:
    """A program of a user's in a terminal, which goes from domain to domain."""
    process = subprocess.Popen([*as_user(user), sys.executable, "-c", TERMINAL], env=environment)
    try:
        yield
    finally:
        process.kill()
        process.wait()


def run_all(
    labs: list[str], kernels: int, users: int, *, domains: int = 0, only: str = "", disturbed: bool = True
) -> list[Seen]:
    """Run notebooks side by side, and return what was seen in each.

    Args:
        labs: their solutions are run, in turn.
        kernels: how many notebooks.
        users: how many people they are of; one where nobody but root could be another.
        domains: how many domains the machine is to have; 0 for as many as it has.
        only: a pattern for the ids of the cells that are run; empty for all.
        disturbed: whether kernels are killed, and programs run in terminals, meanwhile.
    """
    root = Path(tempfile.mkdtemp(prefix="side-by-side-"))
    root.chmod(0o755)
    people = USERS[:users] if os.getuid() == 0 else (os.getuid(),)
    try:
        for number in range(kernels):
            user, lab = people[number % len(people)], labs[number % len(labs)]
            shutil.copytree(SOLUTIONS / lab, root / str(user) / f"{number}-{lab}")
        started = []
        with contextlib.ExitStack() as stack:
            for user in people:
                folder = root / str(user)
                for path in (folder, *folder.rglob("*")):
                    os.chown(path, user, user if os.getuid() == 0 else -1)
                environment = {**os.environ, "HOME": str(folder)}
                for name in [one for one in environment if one.startswith(("ROS_", "FASTRTPS", "AUTOGRADER", "XDG"))]:
                    del environment[name]
                line = [
                    sys.executable,
                    str(HERE / "side_by_side.py"),
                    "--as-user",
                    str(folder),
                    "--domains",
                    str(domains),
                ]
                line += ["--only", only, *(["--undisturbed"] if not disturbed else [])]
                started.append(subprocess.Popen([*as_user(user), *line], env=environment, cwd=folder))
                if disturbed:
                    stack.enter_context(terminal(user, environment))
            for process in started:
                process.wait()
        return [read(path.parent) for path in sorted(root.glob("*/*/*.ipynb"))]
    finally:
        shutil.rmtree(root, ignore_errors=True)


def read(folder: Path) -> Seen:
    """Read what was noted beside a notebook."""
    seen = Seen(f"{folder.parent.name}/{folder.name}")
    notes = folder / "seen.jsonl"
    for line in notes.read_text().splitlines() if notes.is_file() else ():
        found = json.loads(line)
        seen.launches += 1
        seen.foreign += [name for names in found["foreign"].values() for name in names]
    cells = folder / "cells.json"
    if cells.is_file():
        told = json.loads(cells.read_text())
        seen.cells, seen.wrong = told["ran"], told["wrong"]
    else:
        seen.wrong = ["it did not come to an end"]
    return seen


def main() -> int:
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kernels", type=int, default=20)
    parser.add_argument("--users", type=int, default=len(USERS))
    parser.add_argument("--lab", action="append", help="default: all of them")
    parser.add_argument("--domains", type=int, default=0, help="as if the machine had so few")
    parser.add_argument("--only", default="", help="a pattern for the ids of the cells that are run")
    parser.add_argument("--undisturbed", action="store_true")
    parser.add_argument("--as-user", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.as_user:
        asyncio.run(run_user(options.as_user, options.domains, options.only, not options.undisturbed))
        return 0
    began = time.monotonic()
    labs = options.lab or sorted(path.name for path in SOLUTIONS.iterdir() if path.is_dir())
    found = run_all(
        labs,
        options.kernels,
        options.users,
        domains=options.domains,
        only=options.only,
        disturbed=not options.undisturbed,
    )
    for seen in found:
        print(f"{seen.name}: {seen.launches} launches, {len(seen.foreign)} foreign names, {seen.cells} cells")
        for name in sorted(set(seen.foreign)):
            print(f"  heard: {name}")
        for one in seen.wrong:
            print(f"  wrong: {one}")
    foreign = sum(len(seen.foreign) for seen in found)
    print(
        f"{len(found)} kernels, {sum(seen.launches for seen in found)} launches, {foreign} foreign names,"
        f" {sum(len(seen.wrong) for seen in found)} cells wrong, {time.monotonic() - began:.0f} s"
    )
    return 1 if foreign or any(seen.wrong for seen in found) else 0


if __name__ == "__main__":
    sys.exit(main())
