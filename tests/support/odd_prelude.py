"""Put at the head of a student's program, makes it send odd data: a fuzz of the checks, see `odd_data.py`.

`ODD` and `WHEN`, set before, say what is done to which messages. It runs inside the program, where nothing of the kit's
can be imported; whatever it cannot make odd is sent as it is.
"""

# ruff: noqa: F821
import functools as _functools
import re as _re
import sys as _sys

from rclpy.action.client import ActionClient as _ActionClient
from rclpy.action.server import ActionServer as _ActionServer
from rclpy.action.server import ServerGoalHandle as _ServerGoalHandle
from rclpy.client import Client as _Client
from rclpy.impl.rcutils_logger import RcutilsLogger as _Logger
from rclpy.node import Node as _Node
from rclpy.publisher import Publisher as _Publisher
from rclpy.service import Service as _Service

_OF_NODES = ("_parameters", "parameters_atomically", "_types", "_state", "_states", "_transitions", "_graph")
"""How the names of the services end that every node, or every lifecycle node, has."""
_MANY, _DIGITS = 100_000, "9" * 5000
_TEXTS = {
    "negative": "-1",
    "nan": "nan",
    "infinite": "inf",
    "lowest": "-inf",
    "empty": "",
    "huge": _DIGITS,
    "controls": "\x1b[31m\u202e\r\x07\u0000x",
    "unicode": "٣² ½ ①",
}
_FLOATS = {"negative": -1.0, "nan": float("nan"), "infinite": float("inf"), "lowest": float("-inf"), "huge": 1e308}
_counts: dict = {}


def _due(channel: str) -> bool:
    """Whether this one is to be odd."""
    _counts[channel] = number = _counts.get(channel, -1) + 1
    return WHEN == "all" or (number >= 3 and (WHEN == "later" or number % 3 == 0))


def _text(text: str) -> str:
    if ODD in ("huge", "unicode", "negative", "nan") and _re.search(r"\d", text):
        return _re.sub(r"\d+(\.\d+)?", lambda _: _TEXTS[ODD], text)  # the rest of it may be what a check looks for
    return _TEXTS.get(ODD, text)


def _integer(value: int, kind: str) -> int:
    unsigned, bits = kind.startswith("u") or kind in ("octet", "byte"), int(_re.sub(r"\D", "", kind) or 8)
    low, high = (0, 2**bits - 1) if unsigned else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    odd = {"negative": -1, "infinite": high, "huge": high, "lowest": low, "empty": 0}.get(ODD, value)
    return min(max(odd, low), high)


def _list(values, kind: str):
    if ODD == "empty":
        return []
    if ODD == "huge" and len(values):
        return [_leaf(values[0], kind)] * _MANY
    return [_leaf(value, kind) for value in values]


def _leaf(value, kind: str):
    if isinstance(value, bool):
        return {"empty": False, "lowest": False, "negative": not value}.get(ODD, value)
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, float):
        return _FLOATS.get(ODD, 0.0 if ODD == "empty" else value)
    if isinstance(value, int):
        return _integer(value, kind)
    if hasattr(value, "get_fields_and_field_types"):
        return _odd(value)
    return value


def _odd(message):
    """The message, made odd where that is possible."""
    for name, kind in message.get_fields_and_field_types().items():
        value = getattr(message, name)
        try:
            if "[" in kind or kind.startswith("sequence"):
                inner = _re.sub(r"^sequence<|[,>].*$|\[.*$", "", kind)
                odd = _list(value, inner)
                if "[" in kind:
                    odd = [*odd[: len(value)], *value[len(odd) :]]
            else:
                odd = _leaf(value, kind)
            setattr(message, name, odd)
        except Exception:
            pass
    return message


def _instead(holder, name, make):
    original = getattr(holder, name)
    setattr(holder, name, _functools.wraps(original)(make(original)))


_held: dict = {}


def _publish(original):
    def publish(self, message):
        topic = self.topic
        if topic in ("/rosout", "/parameter_events") or isinstance(message, bytes) or not _due(topic):
            return original(self, message)
        if ODD == "silent":
            return None
        if ODD == "twice":
            original(self, message)
        if ODD == "flood":
            for _ in range(3000):
                original(self, message)
        if ODD == "backwards":
            if topic not in _held:
                _held[topic] = message
                return None
            original(self, message)
            message = _held.pop(topic)
        return original(self, _odd(message))

    return publish


def _respond(original):
    def send_response(self, response, header):
        if ("services" if self.srv_name.endswith(_OF_NODES) else "messages") == WHAT and _due(self.srv_name):
            return None if ODD == "silent" else original(self, _odd(response), header)
        return original(self, response, header)

    return send_response


def _first_odd(channel):
    def make(original):
        def call(self, message, *args, **kwargs):
            return original(self, _odd(message) if _due(channel) else message, *args, **kwargs)

        return call

    return make


def _feedback(original):
    def publish_feedback(self, feedback):
        if ODD == "silent":
            return None
        if ODD == "twice":
            original(self, feedback)
        return original(self, _odd(feedback) if _due("feedback") else feedback)

    return publish_feedback


def _execute(original):
    async def _execute_goal(self, execute, goal_handle):
        async def odd(handle):
            result = execute(handle)
            result = await result if hasattr(result, "__await__") else result
            return _odd(result) if result is not None and _due("result") else result

        return await original(self, odd, goal_handle)

    return _execute_goal


def _declare(original):
    def declare_parameter(self, name, value=None, *args, **kwargs):
        if ODD == "undeclared":
            return original(self, name + "_", value, *args, **kwargs)
        as_text = "x" * 3_000_000 if ODD == "huge" else str(value)
        odd = {
            "text": str(value),
            "list": [value],
            "negative": -1,
            "nan": float("nan"),
            "infinite": float("inf"),
            "huge": as_text if isinstance(value, str) else 2**62,
            "empty": type(value)() if value is not None else "",
        }
        from rcl_interfaces.msg import ParameterDescriptor

        given = original(self, name, odd.get(ODD, value), ParameterDescriptor(dynamic_typing=True))
        self.set_parameters([type(given)(name, value=odd.get(ODD, value))])
        # The program itself goes on with what it has declared; who asks the node is told something else.
        self.__dict__.setdefault("_meant", {})[name] = type(given)(name, value=value)
        return self._meant[name]

    return declare_parameter


def _get(original):
    def get_parameter(self, name):
        return self.__dict__.get("_meant", {}).get(name) or original(self, name)

    return get_parameter


def _log(original):
    def log(self, message, severity, **kwargs):
        if ODD == "silent":
            return False
        return original(self, _text(str(message)) if _due("log") else message, severity, **kwargs)

    return log


class _Printed:
    def __init__(self, stream):
        self._stream = stream

    def write(self, text):
        return self._stream.write(text if text.isspace() or not _due("print") else _text(text))

    def __getattr__(self, name):
        return getattr(self._stream, name)


if WHAT in ("messages", "services"):
    _instead(_Service, "send_response", _respond)
if WHAT == "messages":
    _instead(_Publisher, "publish", _publish)
    _instead(_Client, "call_async", _first_odd("requests"))
    _instead(_ActionClient, "send_goal_async", _first_odd("goals"))
    _instead(_ServerGoalHandle, "publish_feedback", _feedback)
    _instead(_ActionServer, "_execute_goal", _execute)
elif WHAT == "logs":
    _instead(_Logger, "log", _log)
    _sys.stdout = _Printed(_sys.stdout)
elif WHAT == "parameters":
    _instead(_Node, "declare_parameter", _declare)
    _instead(_Node, "get_parameter", _get)
