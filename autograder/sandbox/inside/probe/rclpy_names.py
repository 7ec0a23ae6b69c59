"""All private names of rclpy that are used inside a program, and a check that the installed rclpy still has them.

They are those of rclpy 7.1, which belongs to Jazzy. Public names of rclpy are not listed here.
"""

import inspect
from collections.abc import Iterator
from typing import Any

TAKES = ("_take_timer", "_take_subscription", "_take_service")
"""The methods of `Executor` that take a ready entity and return the coroutine function that runs its callback."""
TAKE_ANSWER = "_take_client"
SET_PARAMETERS = "_set_parameters_atomically"
"""The method of `Node` that every way of setting parameters calls in the end."""
ACTION_REQUESTS = ("send_goal_async", "_cancel_goal_async", "_get_result_async")
"""The methods of `ActionClient` that send a request and register that its response is expected."""
REGISTER_TRANSITION = "_LifecycleNodeMixin__register_callback"
RUN_CALLBACK = "await_or_execute"
"""The function that runs a callback. Each module that uses it imports it by name."""


def callers_of_callbacks(rclpy: Any) -> tuple[Any, ...]:
    """Return the modules that have `RUN_CALLBACK`."""
    return rclpy.executors, rclpy.action.server, rclpy.action.client


def nodes_of(executor: Any) -> list[Any]:
    """Return an executor's nodes. The executor's own `get_nodes` would wait for its lock."""
    return list(executor._nodes)


def thread_count(executor: Any) -> int | None:
    """Return how many threads a multi-threaded executor has; None for another executor."""
    count: int | None = getattr(getattr(executor, "_executor", None), "_max_workers", None)
    return count


def is_of_a_rate(group: Any, node: Any) -> bool:
    """Whether a callback group is that of the timers of a node's `Rate` objects."""
    return group is not None and group is getattr(node, "_rate_group", None)


def action_callbacks(server: Any) -> tuple[Any, Any, Any, Any]:
    """Return the execute, goal, cancel and accepted callbacks of an action server."""
    return server._execute_callback, server._goal_callback, server._cancel_callback, server._handle_accepted_callback


def server_parts(server: Any) -> tuple[Any, Any]:
    """Return the node and the action class of an action server."""
    return server._node, server.action_type


def server_of(goal: Any) -> Any:
    """Return the action server of a goal."""
    return goal._action_server


def lifecycle_state(node: Any) -> str:
    """Return the name of a lifecycle node's state."""
    return str(node._state_machine.current_state[1])


def moved(rclpy: Any) -> list[str]:
    """Return a sentence for each of these names that is missing or different in the installed rclpy.

    Call this before anything is wrapped.
    """
    return [
        f"The probe uses {name} of rclpy, which the installed version {what}." for name, what in _differences(rclpy)
    ]


def _differences(rclpy: Any) -> Iterator[tuple[str, str]]:
    functions = [(rclpy.executors.Executor, name, 2) for name in (*TAKES, TAKE_ANSWER)]
    functions += [(module, RUN_CALLBACK, 2) for module in callers_of_callbacks(rclpy)]
    functions += [(rclpy.lifecycle.LifecycleNodeMixin, REGISTER_TRANSITION, 3)]
    for owner, name, count in functions:
        function = getattr(owner, name, None)
        if function is None:
            yield f"{owner.__name__}.{name}", "does not have"
        elif len(inspect.signature(function).parameters) != count:
            yield f"{owner.__name__}.{name}", "calls with other arguments"
    for name in (*ACTION_REQUESTS, "execute"):
        if not hasattr(rclpy.action.ActionClient, name):
            yield f"ActionClient.{name}", "does not have"
    if not hasattr(rclpy.node.Node, SET_PARAMETERS):
        yield f"Node.{SET_PARAMETERS}", "does not have"
    if not hasattr(rclpy.lifecycle.node._rclpy.LifecycleStateMachine, "current_state"):
        yield "LifecycleStateMachine.current_state", "does not have"
    # Attributes that an object gets when it is created are looked for in the names that the creating code uses.
    for owner, method, name in (
        (rclpy.executors.Executor, "__init__", "_nodes"),
        (rclpy.executors.MultiThreadedExecutor, "__init__", "_executor"),
        (rclpy.executors.ThreadPoolExecutor, "__init__", "_max_workers"),
        (rclpy.node.Node, "__init__", "_rate_group"),
        (rclpy.action.ActionServer, "register_execute_callback", "_execute_callback"),
        (rclpy.action.ActionServer, "register_goal_callback", "_goal_callback"),
        (rclpy.action.ActionServer, "register_cancel_callback", "_cancel_callback"),
        (rclpy.action.ActionServer, "register_handle_accepted_callback", "_handle_accepted_callback"),
        (rclpy.action.ActionServer, "__init__", "_node"),
        (rclpy.action.server.ServerGoalHandle, "__init__", "_action_server"),
        (rclpy.lifecycle.LifecycleNodeMixin, "__init__", "_state_machine"),
    ):
        code = getattr(getattr(owner, method, None), "__code__", None)
        if code is None or name not in code.co_names:
            yield f"{owner.__name__}.{name}", "does not have"
