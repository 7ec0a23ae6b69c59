"""One action of a launch file while it runs: its texts with their substitutions done, and the files it names."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

from rclpy.exceptions import InvalidNamespaceException, InvalidNodeNameException
from rclpy.validate_namespace import validate_namespace
from rclpy.validate_node_name import validate_node_name

from autograder.core import student_yaml
from autograder.core.student_yaml import FILE_BYTES
from autograder.graph.names import nearest
from autograder.launch_files import substitutions, values
from autograder.launch_files.errors import Place, refused
from autograder.launch_files.nodes import Inline, LaunchedNode, ParamsFile, ParamsText
from autograder.launch_files.schema import Action, refusing
from autograder.launch_files.substitutions import Context
from autograder.launch_files.texts import Text, parse
from autograder.reasons import Refused

# `launch_ros` keeps these three among the launch configurations; the lists are not copied for a group.
NAMESPACE, RULES, PARAMETERS = "ros_namespace", "ros_remaps", "global_params"
_KIT_VARIABLES = ("LD_", "PYTHON", "ROS_", "RMW_", "FASTRTPS_", "FASTDDS_", "AUTOGRADER", "_")


class Doing:
    """One action and what is known when it runs."""

    def __init__(self, action: Action, context: Context) -> None:
        """Keep both."""
        self.action, self.context = action, context
        self.given, self.place = action.given, action.place

    def perform(self, text: Text, place: Place) -> str:
        """A text with its substitutions done."""
        done: str = refusing(place, lambda: substitutions.perform(text, self.context, self.place.folder))
        return done

    def text(self, key: str) -> str:
        """The text behind a key that is there."""
        return self.perform(self.given[key], self.place.at(key))

    def name(self) -> str:
        """The node's name; empty without one."""
        if "name" not in self.given:
            return ""
        name = self.text("name")
        try:
            validate_node_name(name)
        except InvalidNodeNameException as error:
            raise self.place.at("name").error(*_invalid(f"`{name}` cannot name a node", error)) from None
        return name

    def command_line(self, key: str) -> list[str]:
        """The words of a command line; none if the key is not there."""
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
        """The node's own remap rules."""
        place = self.place.at("remap")
        return [
            (self.perform(rule["from"], place), self.perform(rule["to"], place)) for rule in self.given.get("remap", [])
        ]

    def environment(self) -> dict[str, str | None]:
        """The variables that the file sets for a program, those of the node's own included."""
        found = {key: value for key, value in self.context.environment.items() if key not in substitutions.JAZZY}
        for pair in self.given.get("env", []):
            name = self.perform(pair["name"], self.place.at("env"))
            self.settable(name)
            found[name] = self.perform(pair["value"], self.place.at("env"))
        return found

    def condition(self) -> bool:
        """Whether `if` or `unless` lets the action run."""
        for key in ("if", "unless"):
            if key in self.given:
                word = self.text(key).strip().lower()
                if word not in ("true", "1", "false", "0"):
                    raise self.place.at(key).error(f"a condition is true, false, 1 or 0, not `{word}`.")
                return (word in ("true", "1")) == (key == "if")
        return True

    def unreserved(self, name: str) -> None:
        """Refuse names of launch configurations that `launch_ros` uses itself."""
        if name in (NAMESPACE, RULES, PARAMETERS):
            raise self.place.error(f"`{name}` is a name that `launch_ros` uses itself; it is not covered here.")

    def settable(self, name: str) -> None:
        """Refuse environment variables on which the kit relies."""
        if name.startswith(_KIT_VARIABLES) or substitutions.of_the_machine(name):
            raise self.place.error(f"the environment variable `{name}` is the kit's; setting it is not covered here.")

    def file(self, key: str) -> Path | None:
        """The file that a key names; None if there is none."""
        return self.context.packages.file(self.text(key), self.place.folder)

    def missing(self, key: str) -> Exception:
        """The error for a file that does not exist."""
        text = self.text(key)
        near = nearest(text.rsplit("/", 1)[-1], {*self.context.packages.stand_ins, *_beside(self.place.folder)})
        hint = f" Is `{near}` meant?" if near else ""
        return self.place.error(self.no_file(text), f"Write `$(dirname)/NAME.yaml`; NAME is a cell's `%%file`.{hint}")

    def no_file(self, text: str) -> str:
        """Why a path leads to no file."""
        if not text.startswith("/"):
            return f"there is no file `{text}`: `ros2 launch` looks for it in the folder that it is called from."
        installed = self.context.packages.in_installed(text)
        if installed:
            return f"the build installs no `{installed}` below the package's `share` folder."
        name = text.rsplit("/", 1)[-1]
        return (
            f"there is no file `{name}` there; a package of a lab has its files in `launch/`, and others are not read."
        )

    def parameters(self, node: LaunchedNode) -> None:
        """Add the parameters of a node's own."""
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
        """The parameters of one `param` entry; those of entries inside it get dotted names."""
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
        """A parameter file with its substitutions done."""

        def read() -> ParamsText:
            text = parse(_text_of(path))
            substitutions.check(text)
            done = substitutions.perform(text, self.context, self.place.folder)
            try:
                student_yaml.load(done, f"`{path.name}` with its substitutions done")
            except Refused as error:
                if error.reason.kind is student_yaml.NOT_YAML:  # what `launch` lets pass is the program's to read
                    raise refused(error.reason.because, "A value that holds a colon stands in quotes.") from None
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
    """The text of a file, which the build of a package may have made.

    Raises:
        Refused: it is no text, or too large.
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
    """A namespace below another, None if there is neither; an absolute one (leading slash) stands alone."""
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
    """rclpy's reason why a name is invalid, as one sentence."""
    reason = str(error).splitlines()[0].split(": ", 1)[-1].rstrip(".:")
    if "${" in what:
        return f"{what}: {reason}.", "The value of an argument is written with round brackets: `$(var NAME)`."
    return f"{what}: {reason}.", "A name has letters, digits and underscores, and no part of it begins with a digit."
