"""Watches messages: how many are published, and which field is wrong if a message cannot be sent."""

import functools
from typing import Any

from . import events
from .records import thing_of
from .student_lines import own_line
from .writing import emit_once, quiet


def watch_messages(rclpy: Any) -> None:
    """Wrap the functions that send a message, a response or a request."""
    publish = rclpy.publisher.Publisher.publish

    @functools.wraps(publish)
    def publish_noted(self: Any, msg: Any) -> None:
        try:
            publish(self, msg)
        except Exception:
            with quiet():
                note_misfit("message", self.topic_name, msg, self.msg_type)
            raise
        with quiet():
            thing = thing_of(self)
            if thing is not None:
                thing.count()

    rclpy.publisher.Publisher.publish = publish_noted

    respond = rclpy.service.Service.send_response

    @functools.wraps(respond)
    def respond_noted(self: Any, response: Any, header: Any) -> None:
        try:
            respond(self, response, header)
        except Exception:
            with quiet():
                note_misfit("response", self.srv_name, response, self.srv_type.Response)
            raise

    rclpy.service.Service.send_response = respond_noted

    ask = rclpy.client.Client.call_async

    @functools.wraps(ask)
    def ask_noted(self: Any, request: Any) -> Any:
        try:
            return ask(self, request)
        except Exception:
            with quiet():
                note_misfit("request", self.srv_name, request, self.srv_type.Request)
            raise

    rclpy.client.Client.call_async = ask_noted


def note_misfit(kind: str, name: str, message: Any, expected: type) -> None:
    """Write which field of a message has a value of the wrong type, or that the message is not an `expected` object."""
    if isinstance(message, expected):
        found = _misfit(message, "")
    else:
        found = ("", f"{expected.__module__.split('.')[0]} {expected.__name__}", message)
    if found is not None:
        field, wanted, value = found
        event = events.BadMessage(
            kind=kind,
            name=name,
            field=field,
            expected=wanted,
            given=type(value).__name__,
            value=repr(value)[:80],
            **vars(own_line()),
        )
        emit_once(event)


def _misfit(message: Any, path: str) -> tuple[str, str, Any] | None:
    """Return the path, the type and the value of the first field whose value has the wrong type; None if none has."""
    for name, kind in message.get_fields_and_field_types().items():
        value = getattr(message, name)
        if _is_a(value, kind):
            found = _misfit(value, f"{path}{name}.")
            if found is not None:
                return found
        elif not _fits(value, kind):
            return f"{path}{name}", kind, value
    return None


def _is_a(value: Any, kind: str) -> bool:
    """Whether a value is a message of the type that a field requires, such as `geometry_msgs/Point`."""
    return hasattr(value, "get_fields_and_field_types") and type(value).__name__ == kind.rpartition("/")[2]


_RANGES = {f"{sign}int{bits}": (bits, sign == "") for sign in ("", "u") for bits in (8, 16, 32, 64)}


def _fits(value: Any, kind: str) -> bool:
    if kind.startswith("sequence<") or "[" in kind:
        of = kind.removeprefix("sequence<").removesuffix(">").partition(",")[0].partition("[")[0]
        fits = hasattr(value, "__len__") and not isinstance(value, str)
        return fits and (not isinstance(value, (list, tuple)) or all(_fits(one, of) for one in value))
    if kind in _RANGES:
        bits, signed = _RANGES[kind]
        low = -(1 << (bits - 1)) if signed else 0
        return isinstance(value, int) and low <= value < low + (1 << bits)
    if kind.startswith(("string", "wstring")):
        return isinstance(value, str)
    if kind in ("float", "double"):
        return isinstance(value, float)
    if kind == "boolean":
        return isinstance(value, bool)
    if kind == "octet":
        return isinstance(value, bytes)
    return "/" not in kind or (_is_a(value, kind) and _misfit(value, "") is None)
