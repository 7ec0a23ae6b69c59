"""Runs a launch file: what each action does with what the file knows at that moment, and what it starts."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from pathlib import Path

from autograder.launch_files import values
from autograder.launch_files.doing import NAMESPACE, PARAMETERS, RULES, Doing, namespace
from autograder.launch_files.errors import INCLUDE_DEPTH, MOST_ACTIONS, MOST_NODES, Place
from autograder.launch_files.files import Packages
from autograder.launch_files.nodes import ForAll, LaunchedNode, ParamsFile
from autograder.launch_files.schema import Action, read_file, refusing
from autograder.launch_files.substitutions import Context

_OUTPUTS = ("screen", "log", "both", "own_log", "full")


def read_launch_file(
    path: Path,
    arguments: Mapping[str, str],
    find: Callable[[str], Path] | None = None,
    programs: Collection[str] | None = None,
    stand_ins: Mapping[str, str] | None = None,
    around: str = "",
) -> list[LaunchedNode]:
    """Read a launch file and say what it starts, in its order.

    Args:
        path: a launch file in YAML; its folder also holds what it includes and its parameter files.
        arguments: launch arguments, as `name:=value` on the command line of `ros2 launch`.
        find: the folder with a package's files; KeyError if there is no such package. Without it every
            package is the folder of the launch file.
        programs: names of the programs that a package has; without it they are not looked at.
        stand_ins: names of launch files to read in place of included ones, by the names of those.
        around: the namespace that a file which includes this one would push.

    Raises:
        Refused: it is missing, is no launch file, is refused by `ros2 launch`, or uses what is not covered.
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
    """The names of the arguments that a launch file declares, included files left out.

    Raises:
        Refused: it cannot be read.
    """

    def among(actions: list[Action]) -> list[str]:
        own = [action.given["name"] for action in actions if action.kind == "arg"]
        return own + [name for action in actions for name in among(action.children)]

    return among(read_file(path))


class _Reader:
    def __init__(self) -> None:
        self.nodes: list[LaunchedNode] = []
        self.actions = 0

    def file(self, path: Path, context: Context, given: set[str], place: Place, depth: int) -> None:
        """Run a file; `given` are the arguments that whoever starts it gives, `place` is where that stands."""
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
            if Doing(action, context).condition():
                getattr(self, f"_{action.kind.replace('-', '_')}")(Doing(action, context), depth)

    def _arg(self, do: Doing, depth: int) -> None:
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

    def _let(self, do: Doing, depth: int) -> None:
        name = do.text("name")
        do.unreserved(name)
        do.context.configurations[name] = do.text("value")

    def _group(self, do: Doing, depth: int) -> None:
        context = do.context.scoped() if do.given.get("scoped", True) else do.context
        self.run(do.action.children, context, depth)

    def _push_ros_namespace(self, do: Doing, depth: int) -> None:
        before = do.context.configurations.get(NAMESPACE)
        do.context.configurations[NAMESPACE] = namespace(before, do.text("namespace"), do.place)

    def _set_remap(self, do: Doing, depth: int) -> None:
        do.context.configurations.setdefault(RULES, []).append((do.text("from"), do.text("to")))

    def _set_parameter(self, do: Doing, depth: int) -> None:
        place, text = do.place.at("value"), do.text("value")
        value = refusing(place, lambda: values.read_as_yaml(text or "''"))
        said = str(tuple(value)) if isinstance(value, list) else str(value)
        do.context.configurations.setdefault(PARAMETERS, []).append(ForAll(name=do.text("name"), text=said))

    def _set_parameters_from_file(self, do: Doing, depth: int) -> None:
        path = do.file("filename")
        if path is None:
            raise do.missing("filename")
        do.context.configurations.setdefault(PARAMETERS, []).append(
            ParamsFile(file=do.context.packages.called_in_words(path))
        )

    def _set_env(self, do: Doing, depth: int) -> None:
        name = do.text("name")
        do.settable(name)
        do.context.environment[name] = do.text("value")

    def _unset_env(self, do: Doing, depth: int) -> None:
        do.context.environment[do.text("name")] = None

    def _log(self, do: Doing, depth: int) -> None:
        do.text("message")  # it may be refused; where the text goes is the kit's business

    def _include(self, do: Doing, depth: int) -> None:
        path = do.file("file")
        if path is None:
            raise do.missing("file")
        if path.suffix not in (".yaml", ".yml"):
            raise do.place.error(f"`{path.name}` is not a launch file in YAML; others are not covered.")
        pairs = do.given.get("arg", [])
        given = {do.perform(pair["name"], do.place.at("arg")) for pair in pairs}
        # No scope of its own: as in ROS 2 Jazzy, what the file sets stays set, unless the include stands in a group.
        for pair in pairs:
            name = do.perform(pair["name"], do.place.at("arg"))
            do.unreserved(name)
            do.context.configurations[name] = do.perform(pair["value"], do.place.at("arg"))
        self.file(path, do.context, given, do.place, depth + 1)

    def _node(self, do: Doing, depth: int) -> None:
        package, program = do.text("pkg"), do.text("exec")
        do.program(package, program)
        configurations = do.context.configurations
        own_namespace = do.text("namespace") if "namespace" in do.given else None
        output = do.text("output") if "output" in do.given else "log"
        if output not in _OUTPUTS:
            raise do.place.at("output").error(f"`{output}` is none of {', '.join(_OUTPUTS)}.")
        node = LaunchedNode(
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
    """The launch arguments without a default that must be given when the file is started.

    Of several with one name the first counts; those below a condition are not looked at.
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
