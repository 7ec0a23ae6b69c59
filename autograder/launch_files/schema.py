"""The schema of a launch file: which keys each action has, and which values they may have.

A whole file is read and checked before any of it runs, including the parts below `if: "false"`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from autograder.core import student_yaml
from autograder.launch_files import files, substitutions, texts, values
from autograder.launch_files.errors import Place
from autograder.launch_files.texts import Text, parse, unescaped
from autograder.reasons import Refused

_ELSEWHERE = {
    "append_env", "composable_node", "emit_event", "executable", "for_each", "for_loop", "keep",
    "load_composable_node", "node_container", "pop_environment", "pop_launch_configurations", "push_environment",
    "push_launch_configurations", "reset", "reset_environment", "set_ros_log_dir", "set_use_sim_time", "shutdown",
    "test", "timer",
}  # fmt: skip
"""The actions of `ros2 launch` that are not covered here."""
_KEYS_ELSEWHERE = {"cwd", "forwarding", "keep", "launch-prefix", "on_exit", "respawn_max_retries"}
_WHY_NOT = {
    "executable": "only the lab's own programs can be started in the sandbox.",
    "timer": "what is started later is not covered here.",
}


@dataclass
class Action:
    """One action of a launch file that has been read and checked."""

    kind: str
    place: Place
    given: dict[str, Any] = field(default_factory=dict)
    """The values by key. A key that the file leaves out is missing here."""
    children: list[Action] = field(default_factory=list)


def read_file(path: Path) -> list[Action]:
    """Read and check a launch file.

    Raises:
        Refused: the file is missing, is not a launch file, or contains something that `ros2 launch` refuses or that is
            not covered.
    """
    place = Place(path.name, path.resolve().parent)
    body = files.content(path, place)
    if isinstance(body, dict) and set(body) <= {"children", "deprecated"} and "children" in body:
        if not isinstance(body.get("deprecated", ""), str):
            raise place.at("deprecated").error("a text is expected here.")
        body = body["children"]
    if isinstance(body, dict):
        raise place.error("`launch:` has a list below it.", "Each action begins with a `-`: `- node:`.")
    return _actions(body, place.at("launch"))


def _actions(body: Any, place: Place) -> list[Action]:
    if not isinstance(body, list):
        raise place.error("a list of actions is expected, each with a `-`.")
    return [_action(entry, number, place) for number, entry in enumerate(body, start=1)]


def _action(entry: Any, number: int, place: Place) -> Action:
    if not isinstance(entry, dict) or len(entry) != 1:
        raise place.at(f"entry {number}").error(
            "each entry of the list is one action, such as `- node:`.",
            "Write the keys of the action below it, indented further than its name.",
        )
    kind, body = next(iter(entry.items()))
    here = place.at(f"{kind} (entry {number})")
    schema = _SCHEMAS.get(kind) if isinstance(kind, str) else None
    if schema is None:
        known = isinstance(kind, str) and kind in _ELSEWHERE
        raise here.error(
            f"`{kind}` is not covered here{': ' + _WHY_NOT[kind] if kind in _WHY_NOT else '.'}"
            if known
            else f"there is no action `{kind}`.",
            f"Covered are {', '.join(sorted(_SCHEMAS))} of ROS 2's YAML schema.",
        )
    if kind == "group" and isinstance(body, list):
        body = {"children": body}
    given = _keys(body, schema, here)
    if "if" in given and "unless" in given:
        raise here.error("only one of `if` and `unless` can be given.")
    return Action(kind, here, given, given.pop("children", []))


@dataclass(frozen=True)
class Key:
    """One key: the function that reads its value, and whether the key is required."""

    read: Callable[[Any, Place], Any]
    needed: bool = True


def _keys(body: Any, schema: dict[str, Key], place: Place, ignored: bool = False) -> dict[str, Any]:
    """Read the keys below an action.

    Args:
        body: the content of the action.
        schema: the keys of the action.
        place: the place that errors name.
        ignored: whether unknown keys are ignored, as `launch` does in one place.
    """
    if not isinstance(body, dict):
        raise place.error("keys with values are expected here, such as `name: …`, indented further than the action.")
    for key, expected in schema.items():
        if expected.needed and key not in body:
            hint = f"Write `{key}: …` below it."
            if key == "children":
                hint = "Write a list below `group:`: each entry begins with a `-`, such as `- push_ros_namespace:`."
            raise place.error(f"the key `{key}` is missing.", hint)
    unknown = [] if ignored else [str(key) for key in body if key not in schema]
    if unknown:
        known = ", ".join(f"`{key}`" for key in sorted(schema))
        what = "is not covered here" if unknown[0] in _KEYS_ELSEWHERE else "is unknown or not covered here"
        raise place.error(f"the key `{unknown[0]}` {what}.", f"Known here: {known}.")
    written = body.written if isinstance(body, student_yaml.Written) else {}
    return {
        key: schema[key].read(value, place.at(key, written.get(key, "")))
        for key, value in body.items()
        if key in schema
    }


def refusing(place: Place, what: Callable[[], Any]) -> Any:
    """Call a function, and add the place to its error if it is refused."""
    try:
        return what()
    except Refused as error:
        if error.place:
            raise
        raise place.error(error.reason.because, error.reason.hint) from None


def _string(value: Any, place: Place) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, (bool, int, float)):
        written = place.written or str(value)
        key = place.where.rsplit(" > ", 1)[-1]
        what = "a truth value" if isinstance(value, bool) else "a number"
        raise place.error(
            f"`{written}` is {what}; the launch schema wants a text here.", f'Put it in quotes: `{key}: "{written}"`.'
        )
    raise place.error("a text is expected here.", 'Put it in quotes: `"…"`.')


def _text(value: Any, place: Place) -> Text:
    written = _string(value, place)

    def read() -> Text:
        text = parse(written)
        substitutions.check(text)
        return text

    text: Text = refusing(place, read)
    return text


def _escaped(value: Any, place: Place) -> str:
    return unescaped(_string(value, place))


def _command_line(value: Any, place: Place) -> list[Text]:
    found: list[Text] = refusing(place, lambda: texts.split(_text(value, place)))
    return found


def _switch(value: Any, place: Place) -> bool:
    """Read `true`, `false`, or any text, which counts as true because `launch` never reads the text."""
    if not isinstance(value, (bool, str)):
        raise place.error("`true` or `false` is expected here.")
    return bool(value)


def _seconds(value: Any, place: Place) -> float:
    if not isinstance(value, float) or not value >= 0 or math.isinf(value):
        raise place.error("a number of seconds with a decimal point is expected here.", "Write `1.0`, not `1`.")
    return value


def _no_respawn(value: Any, place: Place) -> None:
    if not isinstance(value, str) or value.strip().lower() not in ("false", "0"):
        because = "starting a program again when it ends is not covered here."
        raise place.error(because, 'Leave it out, or write `"false"`.')


def _false(value: Any, place: Place) -> None:
    if value is not False:
        raise place.error("it is not covered here unless it is `false`.")


def _entries(schema: dict[str, Key], ignored: bool = False) -> Callable[[Any, Place], list[dict[str, Any]]]:
    def read(value: Any, place: Place) -> list[dict[str, Any]]:
        if not isinstance(value, list) or not value or not all(isinstance(entry, dict) for entry in value):
            raise place.error("a list is expected here, each entry with a `-` and keys of its own.")
        return [
            _keys(entry, schema, Place(place.file, place.folder, f"{place.where} (entry {number})"), ignored)
            for number, entry in enumerate(value, start=1)
        ]

    return read


def _parameters(value: Any, place: Place) -> list[dict[str, Any]]:
    """Read `param` entries, which have a `name` with a `value` or with nested `param`, or a file (`from`)."""
    if not isinstance(value, list) or not value or not all(isinstance(entry, dict) for entry in value):
        raise place.error("a list is expected here, each entry with a `-` and keys of its own.")
    nested = place.where.count("param (entry") > 0
    found = []
    for number, entry in enumerate(value, start=1):
        here = Place(place.file, place.folder, f"{place.where} (entry {number})")
        if "from" in entry and not nested:
            found.append(_keys(entry, {"from": Key(_text), "allow_substs": Key(_truth_value, False)}, here))
        else:
            found.append(_parameter(entry, here))
    return found


def _parameter(entry: dict[str, Any], place: Place) -> dict[str, Any]:
    keep = Key(lambda value, _: value, False)
    schema = {"name": Key(_text), "value": keep, "type": keep, "param": Key(_parameters, False)}
    given = _keys(entry, schema, place)
    if "param" in given:
        if "value" in given or "type" in given:
            raise place.error("`param` takes the place of `value` and `type`.", "Leave those two out.")
        return given
    if "value" not in given:
        raise place.error("the key `value` is missing.", "Write `value: …` below it.")
    value = refusing(place.at("value"), lambda: values.read(given["value"], given.get("type")))
    return {"name": given["name"], "value": value}


def _truth_value(value: Any, place: Place) -> bool:
    if not isinstance(value, bool):
        raise place.error("`true` or `false` is expected here, without quotes.")
    return value


def _several(names: Iterable[str], read: Callable[[Any, Place], Any]) -> dict[str, Key]:
    return {name: Key(read, needed=False) for name in names}


_NAME_AND_VALUE = {"name": Key(_text), "value": Key(_text)}
_RULE = {"from": Key(_text), "to": Key(_text)}
_CONDITIONS = _several(("if", "unless"), _text)
_NODE = {
    "pkg": Key(_text),
    "exec": Key(_text),
    **_several(("name", "namespace", "exec_name", "output"), _text),
    **_several(("args", "ros_args"), _command_line),
    **_several(("sigterm_timeout", "sigkill_timeout"), _seconds),
    **_several(("emulate_tty",), _switch),
    **_several(("shell",), _false),
    **_several(("respawn",), _no_respawn),
    **_several(("respawn_delay",), _seconds),
    **_several(("remap",), _entries(_RULE)),
    **_several(("env",), _entries(_NAME_AND_VALUE)),
    **_several(("param",), _parameters),
}
_ARGUMENT = {
    "name": Key(_escaped),
    **_several(("default",), _text),
    **_several(("description",), _escaped),
    **_several(("choice",), _entries({"value": Key(_escaped)}, ignored=True)),
}
_SCHEMAS: dict[str, dict[str, Key]] = {
    kind: {**schema, **_CONDITIONS}
    for kind, schema in {
        "arg": _ARGUMENT,
        "let": _NAME_AND_VALUE,
        "group": {"children": Key(_actions), **_several(("scoped",), _switch)},
        "include": {"file": Key(_text), **_several(("arg",), _entries(_NAME_AND_VALUE))},
        "log": {"message": Key(_text)},
        "node": _NODE,
        "push_ros_namespace": {"namespace": Key(_text)},
        "push-ros-namespace": {"namespace": Key(_text)},
        "set_env": _NAME_AND_VALUE,
        "set_parameter": _NAME_AND_VALUE,
        "set_parameters_from_file": {"filename": Key(_text)},
        "set_remap": _RULE,
        "unset_env": {"name": Key(_text)},
    }.items()
}
