"""Loads what every program needs, once and before any fork."""

import contextlib
import functools
import gc
import importlib
import inspect
import sys
import threading
from typing import Any

from .kernel import PR_SET_CHILD_SUBREAPER, PR_SET_DUMPABLE, libc, prctl
from .probe import attach, rclpy_names


def keep_answers(client_class: Any) -> None:
    """Make every action client process a response only after it has registered the request.

    The client sends a request, and only then registers that it waits for the response. If another thread spins the
    node, the response may be processed in between: rclpy ignores it with a warning, and the future is never done
    (ros2/rclpy issue 1123; versions after 7.1 hold a lock). How often that happens depends on how busy the machine is,
    and a verdict must not depend on that.

    Args:
        client_class: rclpy's `ActionClient`.
    """
    asking = threading.RLock()

    def noted(send: Any) -> Any:
        @functools.wraps(send)
        def send_and_note(*args: Any, **kwargs: Any) -> Any:
            with asking:
                return send(*args, **kwargs)

        return send_and_note

    for name in rclpy_names.ACTION_REQUESTS:
        setattr(client_class, name, noted(getattr(client_class, name)))
    execute = client_class.execute

    @functools.wraps(execute)
    async def execute_after(*args: Any, **kwargs: Any) -> Any:
        with asking:
            pass  # all requests that were being sent are registered now
        return await execute(*args, **kwargs)

    client_class.execute = execute_after


_MODULES = (
    "rclpy",
    "rclpy.action",
    "rclpy.callback_groups",
    "rclpy.executors",
    "rclpy.lifecycle",
    "rclpy.node",
    "rclpy.parameter",
    "rclpy.qos",
    "builtin_interfaces.msg",
    "geometry_msgs.msg",
    "lifecycle_msgs.srv",
    "rcl_interfaces.msg",
    "rcl_interfaces.srv",
    "sensor_msgs.msg",
    "std_msgs.msg",
    "std_srvs.srv",
    "type_description_interfaces.srv",
)
_GENERATOR = "rosidl_generator_py.generate_py_impl"
_TYPES = (
    "std_msgs.msg:String",
    "std_msgs.msg:Int32",
    "std_srvs.srv:Trigger",
    "std_srvs.srv:SetBool",
    # Every node makes these: its publisher of parameter events, its parameter services, and its type descriptions.
    "rcl_interfaces.msg:ParameterEvent",
    "rcl_interfaces.srv:DescribeParameters",
    "rcl_interfaces.srv:GetParameterTypes",
    "rcl_interfaces.srv:GetParameters",
    "rcl_interfaces.srv:ListParameters",
    "rcl_interfaces.srv:SetParameters",
    "rcl_interfaces.srv:SetParametersAtomically",
    "type_description_interfaces.srv:GetTypeDescription",
)


def warm_up() -> None:
    """Load what programs need, without joining a ROS domain."""
    prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    # The ROS libraries' tracer (LTTng) starts threads when it is loaded, and ends them when the process exits. A fork
    # does not have these threads, and crashes when it exits. Exit handlers run in reverse order. This one is registered
    # before anything is loaded, so it runs after all destructors of C++ objects and before the libraries' own
    # finalization.
    libc.on_exit(libc._exit, None)
    gc.disable()  # nothing that is loaded here is garbage
    load_ros()
    with contextlib.suppress(Exception):
        attach.prepare()
    with contextlib.suppress(Exception):  # the probe reports what has changed in rclpy
        keep_answers(sys.modules["rclpy.action"].ActionClient)
    _find_modules_by_file()
    keep_shared()
    # From here on, no program can trace this process or its forks, or open their memory or descriptors. This is done
    # after the imports.
    prctl(PR_SET_DUMPABLE, 0)


def load_ros() -> None:
    """Load rclpy, the usual messages, and the middleware."""
    # The message packages try to load their own generator, but work without it. It is blocked here because it takes as
    # long to load as numpy, together with the parser of interface files that it needs.
    sys.modules[_GENERATOR] = None  # type: ignore[assignment]
    for name in _MODULES:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    with contextlib.suppress(Exception):
        import rclpy

        rclpy.get_rmw_implementation_identifier()  # loads the middleware
        for name in _TYPES:
            module, kind = name.split(":")
            # This method is private to the message packages' generator. Without this call, the first message would load
            # the type support in every program.
            getattr(importlib.import_module(module), kind).__class__.__import_type_support__()
    del sys.modules[_GENERATOR]


def _find_modules_by_file() -> None:
    """Let `inspect` learn which file each loaded module is from.

    rclpy's loggers ask it where a line is logged, and the first answer in a process takes longer than making a node,
    because `inspect` resolves the path of every loaded module. It keeps what it has found, and so do the forks.
    """
    with contextlib.suppress(Exception):
        inspect.getmodule(inspect.currentframe())


def keep_shared() -> None:
    """Keep everything that is loaded so far in memory that forks share."""
    gc.freeze()  # otherwise the collector would write to every object, so that no page stays shared
    gc.enable()
