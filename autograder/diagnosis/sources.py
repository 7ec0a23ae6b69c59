"""Finds where a program is: the stacks of its threads, and the student's lines that they are executing."""

from __future__ import annotations

import ast
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from autograder.sandbox.running_program import RunningProgram

LOOKS = 4
"""How often the stacks are read. Several times are needed because a busy loop is in a different line each time."""

Frame = tuple[str, int, str]
"""A stack frame: file, line and function."""

Stacks = dict[int, list[Frame]]
"""The frames of each thread, with the newest call first. The main thread is the last one."""

_TAKING = ("acquire", "__enter__", "wait")
"""The functions of `threading` in which a thread waits for a lock or the like."""

_NOUNS = {"Lock": "lock", "RLock": "lock", "Semaphore": "semaphore", "BoundedSemaphore": "semaphore"}
"""What `threading` makes for callbacks to take, and what that is called."""

_THREAD = re.compile(r"Thread 0x([0-9a-f]+)")
_WRITER = "Current thread"
_FRAME = re.compile(r'\s+File "(.*)", line (\d{1,9}) in (.*)')


@dataclass(frozen=True)
class Place:
    """A line of the student's code, or the loop that contains it."""

    first: int
    last: int
    code: str
    """The first of these lines."""
    loop: str
    """The source of the loop, in which a diagnosis can see what the loop waits for; empty outside a loop."""
    function: str

    def __str__(self) -> str:
        """Return the words for it in a sentence: `line 12 (...)` or `the loop in lines 12 to 14 (...)`."""
        if self.loop:
            lines = f"line {self.first}" if self.first == self.last else f"lines {self.first} to {self.last}"
            return f"the loop in {lines} (`{self.code}`)"
        return f"line {self.first} (`{self.code}`)" if self.code else f"line {self.first}"


def look(program: RunningProgram, times: int = LOOKS) -> list[Stacks]:
    """Read the stacks of a program several times. Each reading takes about 50 ms."""
    return [found for found in (parse(program.stacks(1.0)) for _ in range(times)) if found]


def parse(dump: str) -> Stacks:
    """Parse the output of faulthandler."""
    stacks: Stacks = {}
    thread = None
    for line in dump.splitlines():
        if head := _THREAD.match(line):
            thread = int(head[1], 16)
            stacks[thread] = []
        elif line.startswith(_WRITER):
            thread = None  # the thread that writes the stacks does not belong to the student's code
        elif thread is not None and (frame := _FRAME.match(line)):
            stacks[thread].append((frame[1], int(frame[2]), frame[3]))
    return stacks


def inside_rclpy(name: str, frames: Sequence[Frame]) -> bool:
    """Whether the innermost line of the program `name` on this stack is a call into rclpy that has not returned."""
    own = next((number for number, frame in enumerate(frames) if frame[0].endswith(f"/{name}.py")), 0)
    return any("/rclpy/" in frame[0] for frame in frames[:own])


class Source:
    """The source of a student's program."""

    def __init__(self, path: Path) -> None:
        """Read the file. If it cannot be read or parsed, it is treated as an empty program."""
        self._name = path.name
        try:
            text = path.read_text(encoding="utf-8", errors="replace")
            self._tree = ast.parse(text)
            self._lines = text.splitlines()
        except (OSError, SyntaxError, ValueError, RecursionError, MemoryError):
            self._tree, self._lines = ast.Module(body=[], type_ignores=[]), []

    def line(self, number: int) -> str:
        """Return one line, without its indentation."""
        return self._lines[number - 1].strip() if 0 < number <= len(self._lines) else ""

    def calls(self, name: str) -> int:
        """Return the line number of the first call `something.NAME(…)`; 0 if there is none."""
        calls = [node for node in ast.walk(self._tree) if isinstance(node, ast.Call)]
        return min((call.lineno for call in calls if getattr(call.func, "attr", "") == name), default=0)

    def uses(self, name: str) -> bool:
        """Return whether the code contains this name, as a variable or as an attribute."""
        return any(name in (getattr(node, "id", ""), getattr(node, "attr", "")) for node in ast.walk(self._tree))

    def declares(self, parameter: str) -> int:
        """Return the line of the only call that declares a parameter of this name, or 0."""
        calls = [node for node in ast.walk(self._tree) if isinstance(node, ast.Call) and node.args]
        found = [
            call.lineno
            for call in calls
            if getattr(call.func, "attr", "") == "declare_parameter"
            and isinstance(call.args[0], ast.Constant)
            and call.args[0].value == parameter
        ]
        return found[0] if len(found) == 1 else 0

    def place(self, name: str, looks: Sequence[list[Frame]], innermost: bool = False) -> Place | None:
        """Return the place in the student's code where a thread was each time; None if the readings do not agree.

        Args:
            name: the name of the program.
            looks: the thread's frames, once for each reading of the stacks.
            innermost: take the innermost function of the student's; otherwise take the callback that called it.
        """
        found = [self._own(name, frames, innermost) for frames in looks]
        places = [frame for frame in found if frame]
        if not places or len(places) < len(looks) or len({frame[2] for frame in places}) > 1:
            return None
        lines = {frame[1] for frame in places}
        loop = self._loop(lines)
        if loop is not None:
            last = max(getattr(part, "end_lineno", 0) or 0 for part in ast.walk(loop))
            text = "\n".join(self._lines[loop.lineno - 1 : last])
            return Place(loop.lineno, last, self.line(loop.lineno), text, places[0][2])
        if len(lines) > 1:
            return None
        (number,) = lines
        return Place(number, number, self.line(number), "", places[0][2])

    def from_constructor(self, name: str, frames: Sequence[Frame]) -> list[Frame]:
        """Return a thread's frames from the constructor of a node on, without what it has called; empty without one.

        A class that inherits from nothing is not a node, and its constructor may run the whole program.
        """
        nodes = [part for part in ast.walk(self._tree) if isinstance(part, ast.ClassDef) and part.bases]
        for number, (file, line, function) in enumerate(frames):
            own = file.endswith(f"/{name}.py") and function == "__init__"
            if own and any(node.lineno <= line <= (node.end_lineno or 0) for node in nodes):
                return list(frames[number:])
        return []

    def turn(self, name: str, looks: Sequence[list[Frame]]) -> Place | None:
        """Return where a thread waited each time to take a lock, a semaphore or the like; None if it did not."""
        for frames in looks:
            own = next((number for number, frame in enumerate(frames) if frame[0].endswith(f"/{name}.py")), None)
            if own is None or frames[own][1] not in self._takes(self._tree):
                return None
            if not all(f[0].endswith("/threading.py") and f[2] in _TAKING for f in frames[:own]):
                return None
        numbers = {next(f for f in frames if f[0].endswith(f"/{name}.py"))[1] for frames in looks}
        if len(numbers) != 1:
            return None
        (number,) = numbers
        return Place(number, number, self.line(number), "", "")

    def taken(self, line: int) -> str:
        """What is taken in a line, such as `self.lock`."""
        return self._takes(self._tree).get(line, "")

    def noun(self, what: str) -> str:
        """What a thing that is taken is called: a lock or a semaphore; empty if the source does not show it."""
        made = self._made(what)
        return _NOUNS.get(_called(made), "") if made else ""

    def by_hand(self, what: str) -> bool:
        """Whether the source names `acquire` or `release` of a thing, which `with` would call by itself."""
        last = what.rpartition(".")[2]  # what is `self.lock` in a class can be `node.lock` elsewhere
        return any(
            isinstance(node, ast.Attribute)
            and node.attr in ("acquire", "release")
            and ast.unparse(node.value).rpartition(".")[2] == last
            for node in ast.walk(self._tree)
        )

    def single(self, what: str) -> bool:
        """Whether only one thread at a time can hold this: a lock, or a semaphore of 1."""
        made = self._made(what)
        if made is None or _called(made) not in _NOUNS:
            return False
        numbers = [*made.args, *(keyword.value for keyword in made.keywords)]
        return all(isinstance(one, ast.Constant) and one.value == 1 for one in numbers)

    def held_since(self, name: str, looks: Sequence[list[Frame]], what: str) -> int:
        """The line of the `with` by which a thread that waits for a thing holds this thing already; 0 if none is seen.

        A `threading.RLock` may be taken twice by one thread.
        """
        made = self._made(what)
        if not self.single(what) or made is None or _called(made) == "RLock":
            return 0
        lines = [[frame[1] for frame in frames if frame[0].endswith(f"/{name}.py")] for frames in looks]
        held = [
            node.lineno
            for node in ast.walk(self._tree)
            if isinstance(node, ast.With) and what in {ast.unparse(item.context_expr) for item in node.items}
            if all(any(node.body[0].lineno <= line <= (node.end_lineno or 0) for line in each) for each in lines)
        ]
        return min(held, default=0) if lines else 0

    def locks(self, line: int) -> dict[str, int]:
        """Return what the function beginning in a line takes for itself alone (`with self.lock`), and in which lines.

        What the functions that it calls in the same file take is included.
        """
        functions = {node.name: node for node in ast.walk(self._tree) if isinstance(node, ast.FunctionDef)}
        begun = [f for f in functions.values() if min([f.lineno, *(d.lineno for d in f.decorator_list)]) == line]
        called = [
            functions[node.func.attr]
            for function in begun
            for node in ast.walk(function)
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in functions
        ]
        found: dict[str, int] = {}
        for function in [*called, *begun]:
            found |= {what: number for number, what in self._takes(function).items() if self.single(what)}
        return found

    def late_name(self, line: int) -> str:
        """Return the variable of a loop that a lambda in this line of the loop reads when it runs; empty if none."""
        for loop in ast.walk(self._tree):
            if not isinstance(loop, (ast.For, ast.comprehension)):
                continue
            names = {node.id for node in ast.walk(loop.target) if isinstance(node, ast.Name)}
            for made in ast.walk(self._tree if isinstance(loop, ast.comprehension) else loop):
                if isinstance(made, ast.Lambda) and made.lineno == line:
                    given = {each.arg for each in ast.walk(made.args) if isinstance(each, ast.arg)}
                    read = {node.id for node in ast.walk(made.body) if isinstance(node, ast.Name)}
                    found = sorted(names & read - given)
                    if found:
                        return found[0]
        return ""

    def method_calls(self) -> list[tuple[str, ast.Call]]:
        """Return every call in a method of a class, with the method's name."""
        return [
            (method.name, call)
            for part in ast.walk(self._tree)
            if isinstance(part, ast.ClassDef)
            for method in part.body
            if isinstance(method, ast.FunctionDef)
            for call in ast.walk(method)
            if isinstance(call, ast.Call)
        ]

    def _made(self, what: str) -> ast.Call | None:
        """The call that makes a thing (`self.lock = threading.Lock()`), if the source makes it in one place only."""
        given = [node for node in ast.walk(self._tree) if isinstance(node, (ast.Assign, ast.AnnAssign))]
        made = [
            node.value
            for node in given
            if what in {ast.unparse(one) for one in (node.targets if isinstance(node, ast.Assign) else [node.target])}
        ]
        return made[0] if len(made) == 1 and isinstance(made[0], ast.Call) else None

    @staticmethod
    def _takes(tree: ast.AST) -> dict[int, str]:
        """Return the lines in which a lock or the like is taken, and what is taken there."""
        found: dict[int, str] = {}
        for node in ast.walk(tree):
            if isinstance(node, ast.With):
                names = [item.context_expr for item in node.items]
                found |= {one.lineno: ast.unparse(one) for one in names if isinstance(one, (ast.Name, ast.Attribute))}
            elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "acquire":
                found[node.lineno] = ast.unparse(node.func.value)
        return found

    def _own(self, name: str, frames: list[Frame], innermost: bool) -> Frame | None:
        """Return the frame of the student's callback, or that of the innermost function; None if there is none.

        The callback is the outermost frame in the innermost unbroken run of the student's frames.
        """
        found = None
        for frame in frames:
            if frame[0].endswith(f"/{name}.py"):
                found = frame
                if innermost:
                    break
            elif found:
                break
        return found

    def _loop(self, lines: set[int]) -> ast.stmt | None:
        """Return the innermost loop that contains all these lines."""
        loops = [
            node
            for node in ast.walk(self._tree)
            if isinstance(node, (ast.While, ast.For))
            and all(node.lineno <= line <= (node.end_lineno or 0) for line in lines)
        ]
        return min(loops, key=lambda node: (node.end_lineno or 0) - node.lineno, default=None)


def _called(call: ast.Call) -> str:
    """The last word of what is called: `Lock` of `threading.Lock()`."""
    return getattr(call.func, "attr", "") or getattr(call.func, "id", "")
