"""Loading, once and before any fork, what every program needs."""

import contextlib
import functools
import gc
import importlib
import sys
import threading
from typing import Any

from .kernel import PR_SET_CHILD_SUBREAPER, PR_SET_DUMPABLE, libc, prctl
from .probe import attach, rclpy_names


def keep_answers(client_class: Any) -> None:
    """Let an answer wait until the request that it belongs to has been noted, for every action client.

    The client sends a request, and only then notes that it waits for the answer. When another thread spins the node,
    the answer may be looked at in between: rclpy ignores it with a warning, and the future never ends (ros2/rclpy issue
    1123; versions after 7.1 hold a lock). How often that happens depends on how busy the machine is, and a verdict must
    not.

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
            pass  # what was being asked has been noted
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
    "rcl_interfaces.srv",
    "sensor_msgs.msg",
    "std_msgs.msg",
    "std_srvs.srv",
)
_GENERATOR = "rosidl_generator_py.generate_py_impl"
_TYPES = ("std_msgs.msg:String", "std_msgs.msg:Int32", "std_srvs.srv:Trigger", "std_srvs.srv:SetBool")


def warm_up() -> None:
    """Load what programs need, without joining a ROS domain."""
    prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    # The ROS libraries' tracer (LTTng) starts threads when it is loaded, and ends them when the process exits. A fork
    # has not got them, and crashes at its very end. Handlers run last in first out: this one, from before anything
    # was loaded, runs after every destructor of C++ objects and before the libraries' own finish.
    libc.on_exit(libc._exit, None)
    gc.disable()  # of what is loaded here nothing is garbage
    load_ros()
    with contextlib.suppress(Exception):
        attach.prepare()
    with contextlib.suppress(Exception):  # the probe says what of rclpy has moved
        keep_answers(sys.modules["rclpy.action"].ActionClient)
    keep_shared()
    # After the imports: no program can trace a process of these, or open their memory or descriptors, from here on.
    prctl(PR_SET_DUMPABLE, 0)


def load_ros() -> None:
    """Load rclpy, the usual messages, and the middleware."""
    # The message packages look for their own generator, and go on without: with the parser of interface files behind
    # it, it takes as long to load as numpy.
    sys.modules[_GENERATOR] = None  # type: ignore[assignment]
    for name in _MODULES:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    with contextlib.suppress(Exception):
        import rclpy

        rclpy.get_rmw_implementation_identifier()  # loads the middleware
        for name in _TYPES:
            module, kind = name.split(":")
            # Private to the message packages' generator; without it the first message loads it, in every program.
            getattr(importlib.import_module(module), kind).__class__.__import_type_support__()
    del sys.modules[_GENERATOR]


def keep_shared() -> None:
    """Keep what is loaded by now in memory that forks share."""
    gc.freeze()  # the collector would write to every object, and so unshare every page
    gc.enable()
