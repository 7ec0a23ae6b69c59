"""Launch files: ROS 2's YAML launch schema, read without the `launch` packages (they are on no package index).

Covered: `arg`, `let`, `node`, `group`, `push_ros_namespace`, `set_remap`, `set_parameter`, `include`, the conditions
`if` and `unless`, and the substitutions `$(var …)`, `$(dirname)` and `$(find-pkg-share …)`. What they do here is what
`ros2 launch` of Jazzy does with them; everything else is refused with a sentence that says where it stands.

Where the real `launch_ros` can be imported (an apt-installed Jazzy), its parser reads each file too, and what it
refuses is refused here.

A student wrote the file: it is parsed by a safe loader, without aliases (a few lines of which can stand for gigabytes),
and in the grading sandbox only.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel, ConfigDict
from rclpy.exceptions import InvalidNamespaceException, InvalidNodeNameException
from rclpy.validate_namespace import validate_namespace
from rclpy.validate_node_name import validate_node_name

from autograder import student_yaml

INCLUDE_DEPTH = 8
"""Launch files that may include one another, one inside the next."""
MOST_NODES = 32
"""Nodes that one launch may start: more participants than that do not find each other on one machine."""
_MOST_ACTIONS = 1000
_DEEPEST_SUBSTITUTION = 5
_PACKAGE_FOLDERS = ("launch", "config", "params")
"""Where an installed package keeps such files; a lab has them all in one folder."""


class LaunchFileError(Exception):
    """A launch file cannot be used: in which file and where in it, why, and what to do."""

    def __init__(self, file: str, where: str, because: str, hint: str = "") -> None:
        """Keep the parts; the message joins them."""
        place = f"{file}, {where}" if where else file
        super().__init__(f"{place}: {because}")
        self.file, self.where, self.because, self.hint = file, where, because, hint


class Inline(BaseModel):
    """A parameter that stands in the launch file itself."""

    model_config = ConfigDict(extra="forbid")
    name: str
    value: Any


class ParamsFile(BaseModel):
    """A parameter file that a launch file names (`from:`)."""

    model_config = ConfigDict(extra="forbid")
    file: str
    """Its name in the folder of the launch file."""


class LaunchedNode(BaseModel):
    """One program that a launch file starts, with every substitution done."""

    model_config = ConfigDict(extra="forbid")
    package: str
    program: str
    """`exec:`, the name of the executable."""
    namespace: str = ""
    """Absolute; empty when neither the node nor a group gives one."""
    name: str = ""
    """Empty when the launch file leaves it to the program."""
    remappings: list[tuple[str, str]] = []
    parameters: list[Inline | ParamsFile] = []
    """In the order in which they count: a later one wins."""
    arguments: list[str] = []
    """Words of the program's own."""
    ros_words: list[str] = []
    """Further words after `--ros-args`."""

    def rules(self) -> list[str]:
        """The remap rules in the order in which `ros2 launch` passes them."""
        rules = [f"__node:={self.name}"] if self.name else []
        if self.namespace:
            rules.append(f"__ns:={self.namespace}")
        return rules + [f"{old}:={new}" for old, new in self.remappings]

    def ros_arguments(self) -> list[str]:
        """The words that follow `--ros-args`."""
        words = [word for rule in self.rules() for word in ("-r", rule)]
        for parameter in self.parameters:
            if isinstance(parameter, ParamsFile):
                words += ["--params-file", parameter.file]
            else:
                words += ["-p", f"{parameter.name}:={_command_line_value(parameter.value)}"]
        return words + self.ros_words


def read_launch_file(
    path: Path, arguments: Mapping[str, str], find: Callable[[str], Path] | None = None
) -> list[LaunchedNode]:
    """Read a launch file and say what it starts, in its order.

    Args:
        path: a launch file in YAML; its folder also holds what it includes and its parameter files.
        arguments: launch arguments, as `name:=value` on the command line of `ros2 launch`.
        find: the share folder of a package; KeyError if there is no such package. Without it every package is the
            folder of the launch file.

    Raises:
        LaunchFileError: it is missing, is not a launch file, or uses what is not covered.
    """
    scope = _Scope(configurations={name: str(value) for name, value in arguments.items()})
    reader = _Reader(path.resolve().parent, find or (lambda package: path.resolve().parent))
    reader.file(path, scope, depth=1)
    return reader.nodes


@dataclass
class _Scope:
    """What a group keeps for itself: launch configurations, namespace, and rules and parameters for all its nodes."""

    configurations: dict[str, str] = field(default_factory=dict)
    namespace: str = ""
    remappings: list[tuple[str, str]] = field(default_factory=list)
    parameters: list[Inline | ParamsFile] = field(default_factory=list)

    def copy(self) -> _Scope:
        return _Scope(dict(self.configurations), self.namespace, list(self.remappings), list(self.parameters))


@dataclass
class _Place:
    """Where in which file something stands, to be named in an error."""

    file: str
    folder: Path
    where: str = ""

    def at(self, more: str) -> _Place:
        return _Place(self.file, self.folder, f"{self.where} > {more}" if self.where else more)

    def error(self, because: str, hint: str = "") -> LaunchFileError:
        return LaunchFileError(self.file, self.where, because, hint)


class _Reader:
    def __init__(self, folder: Path, find: Callable[[str], Path]) -> None:
        self.folder, self.find = folder, find
        self.nodes: list[LaunchedNode] = []
        self.actions = 0

    def file(self, path: Path, scope: _Scope, depth: int) -> None:
        place = _Place(path.name, path.resolve().parent)
        if depth > INCLUDE_DEPTH:
            raise place.error(
                f"launch files include one another more than {INCLUDE_DEPTH} deep.", "Does a file include itself?"
            )
        if not path.is_file():
            raise place.error(
                "there is no such file.", "Its name is the one after `%%file` in the first line of its cell."
            )
        try:
            content = student_yaml.read(path)
        except student_yaml.StudentFileError as error:
            because = error.because.removeprefix(f"`{path.name}`, ")
            raise place.error(because, error.hint or "Look at the indentation and the `-` there.") from None
        if not isinstance(content, dict) or list(content) != ["launch"] or not isinstance(content["launch"], list):
            raise place.error(
                "a launch file has one key at the top, `launch:`, with a list below it.",
                "Begin with `launch:` and `- node:`.",
            )
        self.run(content["launch"], scope, place.at("launch"), depth)
        _ask_launch_ros(path)

    def run(self, actions: Any, scope: _Scope, place: _Place, depth: int) -> None:
        if not isinstance(actions, list):
            raise place.error("a list of actions is expected, each with a `-`.")
        for number, entry in enumerate(actions, start=1):
            self.actions += 1
            if self.actions > _MOST_ACTIONS:
                raise place.error(f"more than {_MOST_ACTIONS} actions.")
            here = place.at(f"entry {number}")
            if not isinstance(entry, dict) or len(entry) != 1:
                raise here.error(
                    "each entry of the list is one action, such as `- node:`.",
                    "The keys of the action stand below it, indented further than its name.",
                )
            kind, body = next(iter(entry.items()))
            here = place.at(f"{kind} (entry {number})")
            method = getattr(self, f"_{str(kind).replace('-', '_')}", None) if kind in _ACTIONS else None
            if method is None:
                raise here.error(
                    f"`{kind}` is not covered here.",
                    f"Covered are {', '.join(sorted(_ACTIONS))} of ROS 2's YAML schema.",
                )
            if kind == "group" and isinstance(body, list):
                body = {"children": body}
            if not isinstance(body, dict):
                raise here.error(f"`{kind}` has keys of its own below it.")
            attributes = _Attributes(body, here, scope, self.find)
            if attributes.condition():
                method(attributes, scope, here, depth)

    def _arg(self, given: _Attributes, scope: _Scope, place: _Place, depth: int) -> None:
        name = given.text("name")
        default, choices = given.optional_text("default"), given.entries("choice")
        given.optional_text("description")
        given.finish()
        if name not in scope.configurations:
            if default is None:
                raise place.error(
                    f"the launch argument `{name}` has no value: it has no default and none was given.",
                    f"Give it: `{name}:=value`.",
                )
            scope.configurations[name] = default
        allowed = [choice.get("value") for choice in choices]
        if allowed and scope.configurations[name] not in [str(value) for value in allowed]:
            raise place.error(f"`{name}` is `{scope.configurations[name]}`, which is none of its choices.")

    def _let(self, given: _Attributes, scope: _Scope, place: _Place, depth: int) -> None:
        name, value = given.text("name"), given.text("value")
        given.finish()
        scope.configurations[name] = value

    def _group(self, given: _Attributes, scope: _Scope, place: _Place, depth: int) -> None:
        children, scoped = given.raw("children"), given.raw("scoped", True)
        given.finish()
        self.run(children, scope if scoped is False else scope.copy(), place, depth)

    def _push_ros_namespace(self, given: _Attributes, scope: _Scope, place: _Place, depth: int) -> None:
        pushed = given.text("namespace")
        given.finish()
        scope.namespace = _namespace(scope.namespace, pushed, place)

    def _set_remap(self, given: _Attributes, scope: _Scope, place: _Place, depth: int) -> None:
        rule = (given.text("from"), given.text("to"))
        given.finish()
        scope.remappings.append(rule)

    def _set_parameter(self, given: _Attributes, scope: _Scope, place: _Place, depth: int) -> None:
        scope.parameters.append(Inline(name=given.text("name"), value=given.parameter_value("value")))
        given.finish()

    def _include(self, given: _Attributes, scope: _Scope, place: _Place, depth: int) -> None:
        path = self.inside(given.text("file"), place)
        for number, argument in enumerate(given.entries("arg"), start=1):
            one = _Attributes(argument, place.at(f"arg (entry {number})"), scope, self.find)
            name, value = one.text("name"), one.text("value")
            one.finish()
            scope.configurations[name] = value
        given.finish()
        if path.suffix not in (".yaml", ".yml"):
            raise place.error(f"`{path.name}` is not a launch file in YAML; others are not covered.")
        # No scope of its own: as in ROS 2 Jazzy, what the file sets stays set, unless the include stands in a group.
        self.file(path, scope, depth + 1)

    def _node(self, given: _Attributes, scope: _Scope, place: _Place, depth: int) -> None:
        package, program = given.text("pkg"), given.text("exec")
        self.package(package, place)
        name, namespace = given.optional_text("name"), given.optional_text("namespace")
        remappings, parameters = list(scope.remappings), list(scope.parameters)
        for number, entry in enumerate(given.entries("remap"), start=1):
            rule = _Attributes(entry, place.at(f"remap (entry {number})"), scope, self.find)
            remappings.append((rule.text("from"), rule.text("to")))
            rule.finish()
        for number, entry in enumerate(given.entries("param"), start=1):
            one = _Attributes(entry, place.at(f"param (entry {number})"), scope, self.find)
            if "from" in entry:
                parameters.append(ParamsFile(file=self.inside(one.text("from"), place).name))
            else:
                parameters += one.parameter()
            one.finish()
        words = given.words("args")
        ros_words = given.words("ros_args")
        given.raw("output", None)  # where the text goes is the kit's business
        given.finish()
        if name:
            try:
                validate_node_name(name)
            except InvalidNodeNameException as error:
                raise place.at("name").error(*_invalid(f"`{name}` cannot name a node", error)) from None
        full = _namespace(scope.namespace, namespace, place) if namespace else scope.namespace
        self.nodes.append(
            LaunchedNode(
                package=package,
                program=program,
                namespace="" if full == "/" else full,
                name=name or "",
                remappings=remappings,
                parameters=parameters,
                arguments=words,
                ros_words=ros_words,
            )
        )
        if len(self.nodes) > MOST_NODES:
            raise place.error(f"it starts more than {MOST_NODES} nodes.")

    def package(self, name: str, place: _Place) -> Path:
        """The share folder of a package."""
        try:
            return self.find(name)
        except KeyError:
            raise place.at("pkg").error(
                f"there is no package `{name}`.", "`pkg` is the package's name and `exec` the program's: see the task."
            ) from None

    def inside(self, text: str, place: _Place) -> Path:
        """A file beside the launch file; an installed package would have it in a folder such as `launch/`."""
        path = Path(text)
        path = path if path.is_absolute() else place.folder / path
        if path.parent.name in _PACKAGE_FOLDERS and not path.exists():
            path = path.parent.parent / path.name
        path = path.resolve()
        if path.parent != self.folder or not path.is_file():
            raise place.error(
                f"there is no file `{text}` beside the launch file.",
                "Write `$(dirname)/NAME.yaml`; NAME is a cell's `%%file`.",
            )
        return path


_ACTIONS = {
    "arg", "let", "node", "group", "push_ros_namespace", "push-ros-namespace", "set_remap", "set_parameter", "include"
}  # fmt: skip


class _Attributes:
    """The keys below one action; each is asked for once, and what is left over in the end is an error."""

    def __init__(self, body: Any, place: _Place, scope: _Scope, find: Callable[[str], Path]) -> None:
        if not isinstance(body, dict):
            raise place.error("keys with values are expected here, such as `name: …`.")
        self.body, self.place, self.scope, self.find = body, place, scope, find
        self.asked: set[str] = {"if", "unless"}

    def raw(self, key: str, default: Any = ...) -> Any:
        self.asked.add(key)
        if key in self.body:
            return self.body[key]
        if default is ...:
            raise self.place.error(f"the key `{key}` is missing.", f"Write `{key}: …` below it.")
        return default

    def optional_text(self, key: str) -> str | None:
        return None if self.raw(key, None) is None else self.text(key)

    def words(self, key: str) -> list[str]:
        """The words of a command line."""
        try:
            return shlex.split(self.optional_text(key) or "")
        except ValueError as error:
            raise self.place.at(key).error(f"{error}.") from None

    def text(self, key: str) -> str:
        value = self.raw(key)
        if isinstance(value, bool) or not isinstance(value, (str, int, float)):
            raise self.place.at(key).error("a text is expected here.", 'Put it in quotes: `"…"`.')
        if not isinstance(value, str):
            raise self.place.at(key).error(
                f"`{value}` is a number; the launch schema wants a text here.", f'Put it in quotes: `{key}: "{value}"`.'
            )
        return self.substitute(value, key)

    def entries(self, key: str) -> list[dict[str, Any]]:
        value = self.raw(key, [])
        if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
            raise self.place.at(key).error("a list is expected here, each entry with a `-` and keys of its own.")
        return value

    def parameter(self, prefix: str = "") -> list[Inline | ParamsFile]:
        """`name` with a `value`, or with further `param` entries below it, which become dotted names."""
        name = f"{prefix}{self.text('name')}"
        if "param" not in self.body:
            return [Inline(name=name, value=self.parameter_value("value"))]
        found: list[Inline | ParamsFile] = []
        if prefix.count(".") > 8:
            raise self.place.error("parameters are nested too deep.")
        for number, entry in enumerate(self.entries("param"), start=1):
            one = _Attributes(entry, self.place.at(f"param (entry {number})"), self.scope, self.find)
            found += one.parameter(f"{name}.")
            one.finish()
        return found

    def parameter_value(self, key: str) -> Any:
        """A value with its YAML type; a text is read as YAML once more after its substitutions, as in ROS 2."""
        value = self.raw(key)
        if isinstance(value, list):
            items = [self.typed(item, key) for item in value]
            if not items or len({type(item) for item in items}) != 1:
                raise self.place.at(key).error("a list of values of one type is expected.")
            return items
        return self.typed(value, key)

    def typed(self, value: Any, key: str) -> Any:
        if isinstance(value, str):
            text = self.substitute(value, key)
            try:
                value = student_yaml.load(text)
            except student_yaml.StudentFileError:
                value = text
        simple = (bool, int, float, str)
        if isinstance(value, simple) or (
            isinstance(value, list) and value and all(isinstance(item, simple) for item in value)
        ):
            return value
        raise self.place.at(key).error(f"a parameter is a bool, a number, a text or a list of such, not {value!r:.60}.")

    def condition(self) -> bool:
        """Whether `if` and `unless` let the action run."""
        if "if" in self.body and "unless" in self.body:
            raise self.place.error("only one of `if` and `unless` can be given.")
        for key in ("if", "unless"):
            if key in self.body:
                value = self.body[key]
                word = self.substitute(value, key) if isinstance(value, str) else str(value)
                if word.strip().lower() not in ("true", "1", "false", "0"):
                    raise self.place.at(key).error(f"a condition is true, false, 1 or 0, not `{word}`.")
                return (word.strip().lower() in ("true", "1")) == (key == "if")
        return True

    def finish(self) -> None:
        """Refuse every key that nobody asked for, as ROS 2 does."""
        unknown = [str(key) for key in self.body if key not in self.asked]
        if unknown:
            known = ", ".join(sorted(self.asked))
            raise self.place.error(f"the key `{unknown[0]}` is unknown or not covered here.", f"Known here: {known}.")

    def substitute(self, text: str, key: str, depth: int = 0) -> str:
        """Do the `$(…)` of a text, the inner ones first."""
        if depth > _DEEPEST_SUBSTITUTION:
            raise self.place.at(key).error("substitutions are nested too deep.")
        done, rest = "", text
        while "$(" in rest:
            before, rest = rest.split("$(", 1)
            done += before
            end, level = 0, 1
            while level:
                if end == len(rest):
                    raise self.place.at(key).error(f"`$(` is never closed in `{text}`.", "Add the `)`.")
                level += {"(": 1, ")": -1}.get(rest[end], 0)
                end += 1
            done += self.value_of(self.substitute(rest[: end - 1], key, depth + 1), key)
            rest = rest[end:]
        return done + rest

    def value_of(self, inside: str, key: str) -> str:
        kind, *words = inside.split()
        if kind == "var" and words:
            name = words[0].strip("'\"")
            if name in self.scope.configurations:
                return self.scope.configurations[name]
            if len(words) > 1:
                return " ".join(words[1:]).strip("'\"")
            raise self.place.at(key).error(
                f"there is no launch argument `{name}` here.", f"Declare it above with `- arg:` and `name: {name}`."
            )
        if kind == "dirname" and not words:
            return str(self.place.folder)
        if kind == "find-pkg-share" and len(words) == 1:
            try:
                return str(self.find(words[0].strip("'\"")))
            except KeyError:
                raise self.place.at(key).error(f"there is no package `{words[0]}`.") from None
        raise self.place.at(key).error(
            f"the substitution `$({inside})` is not covered here.",
            "Covered are `$(var NAME)`, `$(dirname)` and `$(find-pkg-share PACKAGE)`.",
        )


def _ask_launch_ros(path: Path) -> None:
    """Let the parser of ROS 2 itself read a file, where it is installed; parsing starts and evaluates nothing."""
    try:
        import launch_ros  # noqa: F401 (it brings the actions)
        from launch.frontend import Parser
    except ImportError:
        return
    try:
        root, parser = Parser.load(str(path))
        parser.parse_description(root)
    except Exception as error:
        raise LaunchFileError(path.name, "", f"`ros2 launch` refuses it: {error}") from None


def _namespace(outer: str, inner: str, place: _Place) -> str:
    """A namespace below another; an absolute one (leading slash) stands alone."""
    full = inner if inner.startswith("/") else f"{outer.rstrip('/')}/{inner}"
    full = full.rstrip("/") or "/"
    try:
        validate_namespace(full)
    except InvalidNamespaceException as error:
        raise place.at("namespace").error(*_invalid(f"`{full}` cannot be a namespace", error)) from None
    return full


def _invalid(what: str, error: Exception) -> tuple[str, str]:
    """rclpy's reason why a name is invalid, as one sentence."""
    reason = str(error).splitlines()[0].split(": ", 1)[-1].rstrip(".")
    return f"{what}: {reason}.", "A name has letters, digits and underscores, and no part of it begins with a digit."


def _command_line_value(value: Any) -> str:
    """A parameter value as one word of a command line, with its type kept."""
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, Sequence):
        return "[" + ", ".join(_command_line_value(item) for item in value) + "]"
    return yaml.safe_dump(value).splitlines()[0]
