"""Runs the actions of a launch file on the state of the launch, and collects the nodes that it starts."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any

from rclpy.exceptions import InvalidNamespaceException, InvalidNodeNameException
from rclpy.validate_namespace import validate_namespace
from rclpy.validate_node_name import validate_node_name

from autograder.core import student_yaml
from autograder.core.student_yaml import FILE_BYTES
from autograder.graph.names import nearest
from autograder.launch_files import substitutions, values
from autograder.launch_files.errors import INCLUDE_DEPTH, MOST_ACTIONS, MOST_NODES, Place, refused
from autograder.launch_files.files import Packages
from autograder.launch_files.nodes import ForAll, Inline, NodeAction, ParamsFile, ParamsText
from autograder.launch_files.schema import Action, read_file, refusing
from autograder.launch_files.substitutions import Context
from autograder.launch_files.texts import Text, parse
from autograder.reasons import Refused

# `launch_ros` stores these three as launch configurations. The lists are not copied for a group.
NAMESPACE, RULES, PARAMETERS = "ros_namespace", "ros_remaps", "global_params"
_KIT_VARIABLES = ("LD_", "PYTHON", "ROS_", "RMW_", "FASTRTPS_", "FASTDDS_", "AUTOGRADER", "_")


class ActionInContext:
    """One action, and the state in which it runs."""

    def __init__(self, action: Action, context: Context) -> None:
        """Keep the action and the state."""
        self.action, self.context = action, context
        self.given, self.place = action.given, action.place

    def perform(self, text: Text, place: Place) -> str:
        """Return a text after its substitutions."""
        done: str = refusing(place, lambda: substitutions.perform(text, self.context, self.place.folder))
        return done

    def text(self, key: str) -> str:
        """Return the text of a key that is present."""
        return self.perform(self.given[key], self.place.at(key))

    def name(self) -> str:
        """Return the node's name, or an empty text if the launch file gives none."""
        if "name" not in self.given:
            return ""
        name = self.text("name")
        try:
            validate_node_name(name)
        except InvalidNodeNameException as error:
            raise self.place.at("name").error(*_invalid(f"`{name}` cannot name a node", error)) from None
        return name

    def command_line(self, key: str) -> list[str]:
        """Return the words of a command line; there are none if the key is missing."""
        words = [self.perform(word, self.place.at(key)) for word in self.given.get(key, [])]
        own = words.index("--ros-args") if "--ros-args" in words else len(words)
        for option, file in itertools.pairwise(words if key == "ros_args" else words[own:]):
            if option == "--params-file" and not file.startswith("/"):
                raise self.place.at(key).error(
                    f"`--params-file {file}`: the program looks for it in the folder that `ros2 launch` is called "
                    "from, which is not covered here.",
                    f"Write `--params-file $(dirname)/{file}`.",
                )
        return words

    def rules(self) -> list[tuple[str, str]]:
        """Return the node's own remap rules."""
        place = self.place.at("remap")
        return [
            (self.perform(rule["from"], place), self.perform(rule["to"], place)) for rule in self.given.get("remap", [])
        ]

    def environment(self) -> dict[str, str | None]:
        """Return the variables that the file sets for a program, including those of the node itself."""
        found = {key: value for key, value in self.context.environment.items() if key not in substitutions.JAZZY}
        for pair in self.given.get("env", []):
            name = self.perform(pair["name"], self.place.at("env"))
            self.settable(name)
            found[name] = self.perform(pair["value"], self.place.at("env"))
        return found

    def condition(self) -> bool:
        """Whether `if` and `unless` allow the action to run."""
        for key in ("if", "unless"):
            if key in self.given:
                text = self.text(key).strip()
                word = text.lower()
                if word not in ("true", "1", "false", "0"):
                    known = text in self.context.configurations
                    hint = f"The value of the argument is `$(var {text})`." if known else ""
                    raise self.place.at(key).error(f"a condition is true, false, 1 or 0, not `{text}`.", hint)
                return (word in ("true", "1")) == (key == "if")
        return True

    def unreserved(self, name: str) -> None:
        """Refuse a name of a launch configuration that `launch_ros` uses itself."""
        if name in (NAMESPACE, RULES, PARAMETERS):
            raise self.place.error(f"`{name}` is a name that `launch_ros` uses itself; it is not covered here.")

    def settable(self, name: str) -> None:
        """Refuse an environment variable on which the kit relies."""
        if name.startswith(_KIT_VARIABLES) or substitutions.of_the_machine(name):
            raise self.place.error(f"the environment variable `{name}` is the kit's; setting it is not covered here.")

    def file(self, key: str) -> Path | None:
        """Return the file that a key names, or None if there is no such file."""
        return self.context.packages.file(self.text(key), self.place.folder)

    def missing(self, key: str) -> Exception:
        """Return the error for a file that does not exist."""
        text = self.text(key)
        near = nearest(text.rsplit("/", 1)[-1], {*self.context.packages.stand_ins, *_beside(self.place.folder)})
        hint = f" Is `{near}` meant?" if near else ""
        return self.place.error(self.no_file(text), f"Write `$(dirname)/NAME.yaml`; NAME is a cell's `%%file`.{hint}")

    def no_file(self, text: str) -> str:
        """Return why a path leads to no file."""
        if not text.startswith("/"):
            return f"there is no file `{text}`: `ros2 launch` looks for it in the folder that it is called from."
        installed = self.context.packages.in_installed(text)
        if installed:
            return f"the build installs no `{installed}` below the package's `share` folder."
        name = text.rsplit("/", 1)[-1]
        return (
            f"there is no file `{name}` there; a package of a lab has its files in `launch/`, and others are not read."
        )

    def parameters(self, node: NodeAction) -> None:
        """Add the node's own parameters."""
        for number, entry in enumerate(self.given.get("param", []), start=1):
            place = self.place.at(f"param (entry {number})")
            if "from" not in entry:
                node.parameters += self.inline(entry, "", place)
                continue
            text = self.perform(entry["from"], place.at("from"))
            path = self.context.packages.file(text, self.place.folder)
            if path is None:
                node.warnings.append(f"{place.file}, {place.where}: {self.no_file(text)}")
            elif entry.get("allow_substs"):
                node.parameters.append(self.substituted(path, place))
            else:
                node.parameters.append(ParamsFile(file=self.context.packages.called_in_words(path)))

    def inline(self, entry: dict[str, Any], prefix: str, place: Place) -> list[Inline]:
        """Return the parameters of one `param` entry. Those of nested entries get names with dots."""
        name = prefix + self.perform(entry["name"], place.at("name"))
        if "param" in entry:
            return [one for inner in entry["param"] for one in self.inline(inner, f"{name}.", place)]
        value = refusing(
            place.at("value"),
            lambda: values.settle(
                entry["value"], lambda text: substitutions.perform(text, self.context, self.place.folder)
            ),
        )
        return [Inline(name=name, value=value)]

    def substituted(self, path: Path, place: Place) -> ParamsText:
        """Return the text of a parameter file after its substitutions."""

        def read() -> ParamsText:
            text = parse(_text_of(path))
            substitutions.check(text)
            done = substitutions.perform(text, self.context, self.place.folder)
            try:
                student_yaml.load(done, f"`{path.name}` with its substitutions done")
            except Refused as error:
                if error.reason.kind is student_yaml.NOT_YAML:  # everything else is left to the program, as in `launch`
                    raise refused(error.reason.because, "Write a value with a colon in quotes.") from None
            return ParamsText(text=done)

        found: ParamsText = refusing(place.at("from"), read)
        return found

    def program(self, package: str, program: str) -> None:
        """Refuse a program that the package does not have."""
        packages = self.context.packages
        try:
            packages.folder(package)
        except KeyError:
            raise self.place.at("pkg").error(
                f"there is no package `{package}`.",
                "`pkg` is the package's name and `exec` the program's: see the task.",
            ) from None
        if program.endswith(".py") or not packages.has(program, self.place.file):
            listed = ", ".join(f"`{name}`" for name in sorted(packages.programs or []))
            hint = "A program is called as in the first line of its cell, `%%node NAME`, without `.py`."
            if packages.is_built(package):
                hint = "setup.py names the programs (`entry_points`), and setup.cfg says where they go."
            raise self.place.at("exec").error(
                f"the package `{package}` has no program `{program}`.{f' It has {listed}.' if listed else ''}", hint
            )


def _text_of(path: Path) -> str:
    """Return the text of a file, which may come from the build of a package.

    Raises:
        Refused: the file is not a text, or is too large.
    """
    try:
        with path.open("rb") as file:
            content = file.read(FILE_BYTES + 1)
        if len(content) > FILE_BYTES:
            raise refused(f"`{path.name}` is larger than {FILE_BYTES // 1024} KiB.")
        return content.decode("utf-8")
    except (OSError, UnicodeDecodeError):
        raise refused(f"`{path.name}` cannot be read as text in UTF-8.") from None


def _beside(folder: Path) -> list[str]:
    return [path.name for path in folder.glob("*.yaml")]


def namespace(outer: str | None, inner: str | None, place: Place) -> str | None:
    """Join a namespace to an outer one, unless it is absolute (with a leading slash); None if there is neither."""
    if inner is None:
        joined = outer
    elif not outer or inner.startswith("/"):
        joined = inner
    else:
        joined = f"{outer.rstrip('/')}/{inner}"
    if joined is None:
        return None
    joined = joined if joined == "/" else joined.rstrip("/")
    full = joined if joined.startswith("/") else f"/{joined}"
    try:
        validate_namespace(full)
    except InvalidNamespaceException as error:
        raise place.at("namespace").error(*_invalid(f"`{full}` cannot be a namespace", error)) from None
    return full


def _invalid(what: str, error: Exception) -> tuple[str, str]:
    """Return rclpy's reason why a name is invalid, as one sentence, and a hint."""
    reason = str(error).splitlines()[0].split(": ", 1)[-1].rstrip(".:")
    if "${" in what:
        return f"{what}: {reason}.", "The value of an argument is written with round brackets: `$(var NAME)`."
    return f"{what}: {reason}.", "A name has letters, digits and underscores, and no part of it begins with a digit."


_OUTPUTS = ("screen", "log", "both", "own_log", "full")


def read_launch_file(
    path: Path,
    arguments: Mapping[str, str],
    find: Callable[[str], Path] | None = None,
    programs: Collection[str] | None = None,
    stand_ins: Mapping[str, str] | None = None,
    around: str = "",
) -> list[NodeAction]:
    """Read a launch file and return the programs that it starts, in its order.

    Args:
        path: a launch file in YAML. Its folder also contains the files that it includes, and its parameter files.
        arguments: the launch arguments, which are given as `name:=value` on the command line of `ros2 launch`.
        find: returns the folder with a package's files, or raises KeyError if there is no such package. Without it,
            every package is in the folder of the launch file.
        programs: the names of the programs that a package has; without it, they are not checked.
        stand_ins: the names of launch files to read in place of included ones, by the names of the included ones.
        around: the namespace that a file that includes this one would push.

    Raises:
        Refused: the file is missing, is not a launch file, is refused by `ros2 launch`, or uses something that is not
            covered.
    """
    folder = path.resolve().parent
    reader = _Reader()
    context = Context(
        Packages(find or (lambda package: folder), programs, stand_ins),
        {name: str(value) for name, value in arguments.items()},
    )
    if around:
        context.configurations[NAMESPACE] = around
    reader.file(path, context, set(arguments), Place(path.name, folder), depth=1)
    return reader.nodes


def declared_arguments(path: Path) -> list[str]:
    """Return the names of the arguments that a launch file declares, without those of included files.

    Raises:
        Refused: the file cannot be read.
    """

    def among(actions: list[Action]) -> list[str]:
        own = [action.given["name"] for action in actions if action.kind == "arg"]
        return own + [name for action in actions for name in among(action.children)]

    return among(read_file(path))


class _Reader:
    def __init__(self) -> None:
        self.nodes: list[NodeAction] = []
        self.actions = 0

    def file(self, path: Path, context: Context, given: set[str], place: Place, depth: int) -> None:
        """Run a file.

        Args:
            path: the file.
            context: the state in which it runs.
            given: the names of the arguments that are given to it.
            place: the place from which it is started, which errors name.
            depth: the depth of nested includes.
        """
        if depth > INCLUDE_DEPTH:
            raise place.error(
                f"launch files include one another more than {INCLUDE_DEPTH} deep.", "Does a file include itself?"
            )
        actions = read_file(path)
        for action in _required(actions):
            name = action.given["name"]
            if name not in given:
                called = context.packages.called(path)
                asks = f"`{called}` has" if depth > 1 else "it has"
                raise place.error(
                    f"the launch argument `{name}` has no value: {asks} no default for it, and none was given.",
                    f"Give it in the include's own `arg`, `- {{name: {name}, value: …}}`, or give it a `default` in "
                    f"`{called}`. A `let` or an argument of the file around it does not count."
                    if depth > 1
                    else f"Give it a `default` in the file, or a value at the start: `{name}:=value`.",
                )
        self.run(actions, context, depth)

    def run(self, actions: list[Action], context: Context, depth: int) -> None:
        for action in actions:
            self.actions += 1
            if self.actions > MOST_ACTIONS:
                raise action.place.error(f"more than {MOST_ACTIONS} actions.")
            if ActionInContext(action, context).condition():
                getattr(self, f"_{action.kind.replace('-', '_')}")(ActionInContext(action, context), depth)

    def _arg(self, do: ActionInContext, depth: int) -> None:
        name, configurations = do.given["name"], do.context.configurations
        do.unreserved(name)
        if name not in configurations:
            if "default" not in do.given:
                raise do.place.error(
                    f"the launch argument `{name}` has no value: it has no default and none was given.",
                    f"Give it a `default` in the file, or a value at the start: `{name}:=value`.",
                )
            configurations[name] = do.text("default")
        choices = [choice["value"] for choice in do.given.get("choice", [])]
        if choices and configurations[name] not in choices:
            raise do.place.error(f"`{name}` is `{configurations[name]}`, which is none of its choices.")

    def _let(self, do: ActionInContext, depth: int) -> None:
        name = do.text("name")
        do.unreserved(name)
        do.context.configurations[name] = do.text("value")

    def _group(self, do: ActionInContext, depth: int) -> None:
        context = do.context.scoped() if do.given.get("scoped", True) else do.context
        self.run(do.action.children, context, depth)

    def _push_ros_namespace(self, do: ActionInContext, depth: int) -> None:
        before = do.context.configurations.get(NAMESPACE)
        do.context.configurations[NAMESPACE] = namespace(before, do.text("namespace"), do.place)

    def _set_remap(self, do: ActionInContext, depth: int) -> None:
        do.context.configurations.setdefault(RULES, []).append((do.text("from"), do.text("to")))

    def _set_parameter(self, do: ActionInContext, depth: int) -> None:
        place, text = do.place.at("value"), do.text("value")
        value = refusing(place, lambda: values.read_as_yaml(text or "''"))
        said = str(tuple(value)) if isinstance(value, list) else str(value)
        do.context.configurations.setdefault(PARAMETERS, []).append(ForAll(name=do.text("name"), text=said))

    def _set_parameters_from_file(self, do: ActionInContext, depth: int) -> None:
        path = do.file("filename")
        if path is None:
            raise do.missing("filename")
        do.context.configurations.setdefault(PARAMETERS, []).append(
            ParamsFile(file=do.context.packages.called_in_words(path))
        )

    def _set_env(self, do: ActionInContext, depth: int) -> None:
        name = do.text("name")
        do.settable(name)
        do.context.environment[name] = do.text("value")

    def _unset_env(self, do: ActionInContext, depth: int) -> None:
        do.context.environment[do.text("name")] = None

    def _log(self, do: ActionInContext, depth: int) -> None:
        do.text("message")  # only to refuse an invalid text; the kit does not print it

    def _include(self, do: ActionInContext, depth: int) -> None:
        path = do.file("file")
        if path is None:
            raise do.missing("file")
        if path.suffix not in (".yaml", ".yml"):
            raise do.place.error(f"`{path.name}` is not a launch file in YAML; others are not covered.")
        pairs = do.given.get("arg", [])
        given = {do.perform(pair["name"], do.place.at("arg")) for pair in pairs}
        # An included file has no scope of its own. As in ROS 2 Jazzy, what it sets stays set, unless it is in a group.
        for pair in pairs:
            name = do.perform(pair["name"], do.place.at("arg"))
            do.unreserved(name)
            do.context.configurations[name] = do.perform(pair["value"], do.place.at("arg"))
        self.file(path, do.context, given, do.place, depth + 1)

    def _node(self, do: ActionInContext, depth: int) -> None:
        package, program = do.text("pkg"), do.text("exec")
        do.program(package, program)
        configurations = do.context.configurations
        own_namespace = do.text("namespace") if "namespace" in do.given else None
        output = do.text("output") if "output" in do.given else "log"
        if output not in _OUTPUTS:
            raise do.place.at("output").error(f"`{output}` is none of {', '.join(_OUTPUTS)}.")
        node = NodeAction(
            package=package,
            program=program,
            namespace=namespace(configurations.get(NAMESPACE), own_namespace, do.place) or "",
            name=do.name(),
            remappings=[*configurations.get(RULES, []), *do.rules()],
            parameters=list(configurations.get(PARAMETERS, [])),
            arguments=do.command_line("args"),
            ros_words=do.command_line("ros_args"),
            environment={key: value for key, value in do.environment().items() if value is not None},
            folder=do.place.folder,
        )
        do.parameters(node)
        self.nodes.append(node)
        if len(self.nodes) > MOST_NODES:
            raise do.place.error(f"it starts more than {MOST_NODES} nodes.")


def _required(actions: list[Action]) -> list[Action]:
    """Return the launch arguments without a default, which must be given when the file is started.

    If several have the same name, the first one counts. Arguments below a condition are not required.
    """
    first: dict[str, Action | None] = {}

    def walk(actions: list[Action], conditional: bool) -> None:
        for action in actions:
            depends = conditional or "if" in action.given or "unless" in action.given
            if action.kind == "arg":
                needed = not depends and "default" not in action.given
                first.setdefault(action.given["name"], action if needed else None)
            walk(action.children, depends)

    walk(actions, False)
    return [action for action in first.values() if action is not None]
