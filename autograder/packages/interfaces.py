"""Reads the fields of .msg, .srv and .action files, with the parser of ROS's own generators."""

from __future__ import annotations

from typing import Any


class InterfaceError(ValueError):
    """An interface file cannot be read; the message says why."""


def interface_parts(package: str, name: str, text: str) -> list[dict[str, str]]:
    """Return the fields of a message, of a service's request and response, or of an action's goal, result and feedback.

    Args:
        package: that the interface is of; its own messages are named without it.
        name: such as `msg/DetectedObject`.
        text: of the file.

    Raises:
        InterfaceError: it cannot be read.
    """
    from rosidl_adapter import parser

    kind, _, base = name.partition("/")
    try:
        if kind == "msg":
            found = [parser.parse_message_string(package, base, text)]
        elif kind == "srv":
            service = parser.parse_service_string(package, base, text)
            found = [service.request, service.response]
        else:
            action = parser.parse_action_string(package, base, text)
            found = [action.goal, action.result, action.feedback]
    except Exception as error:  # the parser has a dozen kinds, some of them Python's own
        raise InterfaceError(f"`{name}` cannot be read: {error}.") from error
    return [{field.name: _type(field.type, package) for field in part.fields} for part in found]


def _type(kind: Any, package: str) -> str:
    """A field's type as it is written in a file: `DetectedObject[]`, `std_msgs/Header`."""
    return str(kind).removeprefix(f"{package}/")
