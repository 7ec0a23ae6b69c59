"""Says what went wrong in a callback: an error that ends the spinning, or one that rclpy swallows."""

from __future__ import annotations

import re

from autograder.diagnosis.inside import Inside, events_of
from autograder.diagnosis.scene import Scene, first
from autograder.diagnosis.traces import CRASHED, KNOWN_ERRORS, PARAMETER_NOT_DECLARED, PARAMETER_TYPE, quoted
from autograder.reasons import Group, Kind, Reason
from autograder.sandbox.inside.probe.events import BadMessage, BadReturn, CallbackError, Event, Thing, ThreadError
from autograder.sandbox.running_program import RunningProgram

NEVER_AWAITED = Kind(
    "never-awaited",
    "Python warned about a coroutine that was never awaited, and no message arrived",
    Group.CALLBACKS,
)
CALLBACK_EXCEPTION = Kind(
    "callback-exception",
    "a callback of a timer or subscription raised an exception that nothing caught",
    Group.CALLBACKS,
)
MESSAGE_FIELD = Kind(
    "message-field",
    "a field of a message has a value that is not of its type: it was refused, or what came shows it",
    Group.CALLBACKS,
)
BAD_RETURN = Kind("bad-return", "another callback returned something of the wrong type", Group.CALLBACKS)
THREAD_EXCEPTION = Kind("thread-exception", "an exception ended a thread of the program's own", Group.CALLBACKS)
MESSAGE_TYPE = Kind("message-type", "a message was refused, and it is of another class", Group.CALLBACKS)
SERVICE_NO_RETURN = Kind(
    "service-no-return", "a service callback returned something else than the response", Group.CALLBACKS
)
LIFECYCLE_RETURN = Kind(
    "lifecycle-return", "a lifecycle callback returned something else than a TransitionCallbackReturn", Group.CALLBACKS
)
EXECUTE_RETURN = Kind(
    "execute-return", "an execute callback returned something else than its action's result", Group.GOALS
)
GOAL_RETURN = Kind("goal-return", "a goal callback returned something else than a GoalResponse", Group.GOALS)
CANCEL_RETURN = Kind("cancel-return", "a cancel callback returned something else than a CancelResponse", Group.GOALS)
ASYNCIO_IN_CALLBACK = Kind(
    "asyncio-in-callback", "a callback raised that there is no running event loop", Group.CALLBACKS
)
DECLARED_TWICE = Kind("declared-twice", "a callback raised ParameterAlreadyDeclaredException", Group.CALLBACKS)
SERVICE_EXCEPTION = Kind("service-exception", "an exception left a service callback", Group.CALLBACKS)
LIFECYCLE_EXCEPTION = Kind("lifecycle-exception", "an exception left a lifecycle callback", Group.CALLBACKS)
EXECUTE_EXCEPTION = Kind("execute-exception", "an exception left an execute callback", Group.GOALS)

_AFTER = {
    "service": "The client gets no response and the node no longer spins.",
    "lifecycle": "rclpy swallows it without a log line and treats the transition as ERROR.",
    "execute": "rclpy aborts the goal with an empty result; the node continues.",
}
_KINDS = {"service": SERVICE_EXCEPTION, "lifecycle": LIFECYCLE_EXCEPTION, "execute": EXECUTE_EXCEPTION}

_GOAL_STATE = re.compile(r"invalid transition from state (\w+) with event (\w+)")
"""What rclpy says if a goal cannot be executed, or cannot end with this status, in its current state."""

_NEVER_AWAITED = re.compile(r"RuntimeWarning: coroutine '([\w.<>]{1,100})' was never awaited")


def failed(inside: Inside) -> Reason | None:
    """Must have seen: an exception leave a callback, a return value of the wrong type, or a message refused.

    Errors that concern only one goal of an action and do not affect the node are handled in `goals`.
    """
    for event in inside.events:
        found = None if _outlived(event) else of_event(inside, event)
        if found:
            return found
    return None


def thread_failed(inside: Inside) -> Reason | None:
    """Must have seen: an exception end a thread that the program itself started."""
    for event in inside.all(ThreadError):
        error = f"{event.type}: {event.text}".strip(": ")
        if event.type == "SystemExit":
            return THREAD_EXCEPTION(
                f"A thread of `{inside.name}` ended because of `sys.exit` or SystemExit, which ends only the thread in "
                "which it is raised.",
                "SystemExit ends the whole program only if the main thread raises it.",
            )
        at = f" in {event.line}{quoted(event.code, error)}" if event.line else ""
        return THREAD_EXCEPTION(
            f"A thread of `{inside.name}` ended with an error{at}: {error}",
            "The work of this thread is no longer done; the rest of the program continues.",
        )
    return None


def never_awaited(inside: Inside) -> Reason | None:
    """Must have seen: Python's own warning about a coroutine that was created and never awaited."""
    found = _NEVER_AWAITED.search(inside.program.output())
    if not found:
        return None
    return NEVER_AWAITED(
        f"`{inside.name}`: the coroutine `{found[1]}` was called, but never awaited (Python says so in the log), so "
        "none of its code has run.",
        "Calling an `async def` function only creates a coroutine, so await it. Pass the function itself to rclpy, "
        "because rclpy does not await what a lambda returns.",
    )


def failed_in_a_callback(scene: Scene) -> RunningProgram | None:
    """Return a program with an error in a callback that ends it.

    An error in a lifecycle callback does not end the node, and neither does a parameter callback that returns nothing:
    then the value is refused, and rclpy warns. It is not predictable when the program ends, because a multi-threaded
    executor of rclpy 7.1 looks for errors only at its next event.
    """
    for program in scene.programs:
        for event in events_of(program):
            if _outlived(event):
                continue
            if isinstance(event, CallbackError) and event.kind != "lifecycle":
                return program
            if isinstance(event, BadReturn) and event.kind not in ("lifecycle", "parameter"):
                return program
    return None


def called_from_outside(program: RunningProgram) -> tuple[str, float] | None:
    """Return what called the first callback with an error (a topic, a service or "parameter"), and when it failed.

    Must have seen: that such a callback was the first thing that went wrong. A timer's callback does not count, because
    nothing from outside triggers it.
    """
    said = [event for event in events_of(program) if not _outlived(event)]
    errors = [event for event in said if isinstance(event, CallbackError | BadReturn)]
    first = errors[0] if errors else None
    if not isinstance(first, CallbackError) or first.kind not in ("subscription", "service", "parameter"):
        return None
    return (first.kind if first.kind == "parameter" else first.name), first.when


def _outlived(event: Event) -> bool:
    """Whether rclpy continues after this error, and only aborts the goal, rejects it, or does not cancel it."""
    if isinstance(event, CallbackError):
        return event.kind == "execute"
    return isinstance(event, BadReturn) and event.kind in ("goal", "cancel")


def of_event(inside: Inside, event: Event) -> Reason | None:
    """Return the reason that an event gives, if it is an error."""
    if isinstance(event, BadMessage):
        return _bad_message(inside.name, event)
    if isinstance(event, BadReturn):
        return _bad_return(inside.name, event)
    if isinstance(event, CallbackError):
        return _no_callback(inside, event) or _error(inside.name, event)
    return None


def _no_callback(inside: Inside, event: CallbackError) -> Reason | None:
    """Must have seen: None called in place of a callback, and a timer or the like created without a function."""
    empty = [t for t in inside.things.values() if t.kind == event.kind and t.has_callback and not t.line and t.made]
    if event.line or "'NoneType' object is not callable" not in event.text or not empty:
        return None
    number = int(empty[0].made.rpartition(":")[2] or 0)
    return CALLBACK_EXCEPTION(
        f"`{inside.name}`: the callback of the {event.kind} that line {number} (`{inside.source.line(number)}`) "
        "creates is None.",
        "Pass the function itself, without brackets. With brackets, the function is called immediately, and its return "
        "value is passed.",
    )


def _bad_message(program: str, event: BadMessage) -> Reason:
    at = f" in {event.line} (`{event.code}`)" if event.line else ""
    if not event.field:
        return MESSAGE_TYPE(
            f"`{program}` sends the wrong type on `{event.name}`{at}: the {event.kind} must be a {event.expected}, "
            f"but it is {event.value} ({event.given}).",
            "The message class must be the one with which the publisher, client or service was created.",
        )
    if event.kind in ("feedback", "result") and event.expected in ("float", "double"):
        return MESSAGE_FIELD(
            f"`{program}` sends a wrong number in its {event.kind} on `{event.name}`{at}: the field `{event.field}` is "
            f"of type {event.expected}, and its value is {event.value} ({event.given}), which rclpy does not convert.",
            "Assign a float: use `float(...)` or a number with a decimal point. Otherwise a wrong number is sent, "
            "without an error message.",
        )
    return MESSAGE_FIELD(
        f"`{program}` cannot send its {event.kind} on `{event.name}`{at}: the field `{event.field}` is of type "
        f"{event.expected}, and its value is {event.value} ({event.given}).",
        "Python does not notice when the field is set, only when the message is sent: convert the value first.",
    )


def _bad_return(program: str, event: BadReturn) -> Reason:
    at = f" ({event.line})" if event.line else ""
    if event.kind == "service":
        return SERVICE_NO_RETURN(
            f"A service callback of `{program}`{at} did not return the response, which ends the node's spinning, so "
            "the client never gets a response.",
            "Fill `response` and `return response`.",
        )
    if event.kind == "lifecycle":
        return LIFECYCLE_RETURN(
            f"A lifecycle callback of `{program}`{at} did not return a TransitionCallbackReturn: the node stops "
            "answering in the middle of the transition.",
            "Return TransitionCallbackReturn.SUCCESS, FAILURE or ERROR from every path.",
        )
    of_action = f"The {event.kind} callback of `{program}`{at} returned {event.text or 'the wrong type'}:"
    if event.kind == "execute":
        return EXECUTE_RETURN(
            f"{of_action} rclpy cannot send that as a result, the error ends the spinning, and the client never gets "
            "a result.",
            "Every path of an execute callback returns a result of the action, also after `canceled()` and `abort()`.",
        )
    if event.kind == "goal":
        return GOAL_RETURN(
            f"{of_action} rclpy treats any value other than a GoalResponse as a rejection of the goal.",
            "Return GoalResponse.ACCEPT or GoalResponse.REJECT from every path.",
        )
    if event.kind == "cancel":
        return CANCEL_RETURN(
            f"{of_action} rclpy treats any value other than a CancelResponse as a refusal to cancel.",
            "Return CancelResponse.ACCEPT, or CancelResponse.REJECT, from every path.",
        )
    return BAD_RETURN(
        f"A {event.kind} callback of `{program}`{at} returned {event.text or 'the wrong type'}.",
        "Every path of the callback must return a value of that type.",
    )


def _ended_already(error: str) -> bool:
    """Whether the error says that the goal had already ended."""
    found = _GOAL_STATE.search(error)
    return found is not None and found[1] in ("SUCCEEDED", "CANCELED", "ABORTED")


def _of_goal_state(error: str) -> str:
    """Return what to do if a goal's current state does not allow what the program did; empty for another error."""
    found = _GOAL_STATE.search(error)
    if not found:
        return ""
    if found[2] == "EXECUTE":
        return (
            "`execute()` was called for a goal whose execution has already begun, or that has ended. Call it once for "
            "each goal. rclpy does that itself if the server has no `handle_accepted_callback`."
        )
    if _ended_already(error):
        return (
            "The goal had already ended, and a goal can end only once. `goal_handle.is_active` says whether it can "
            "still be ended. Write `return` directly after the call that ends the goal."
        )
    if found[2] == "CANCELED":
        return (
            "Call `canceled()` in the execute callback, and only while `goal_handle.is_cancel_requested` is true. "
            "rclpy does not allow it without a request to cancel this goal. If the server itself gives up the goal, "
            "call `abort()`."
        )
    return "The goal was accepted, but its execution has not begun. Call `goal_handle.execute()` first."


def _error(program: str, event: CallbackError) -> Reason:
    error = f"{event.type}: {event.text}".strip(": ")
    at = f" ({event.line})" if event.line else ""
    name = "done" if event.kind == "task" else event.kind  # rclpy runs done callbacks as tasks
    article = "An" if name[:1] in ("a", "e") else "A"  # no kind of callback begins with another vowel
    callback = f"{article} {name} callback of `{program}`{at}" if name else f"A callback of `{program}`{at}"
    source = quoted(event.code, error)
    if "no running event loop" in error:
        return ASYNCIO_IN_CALLBACK(
            f"{callback} awaits asyncio{source}, and rclpy does not run an asyncio loop ({error}).",
            "Await rclpy futures only (such as the one of `call_async`), or use a timer.",
        )
    if "ParameterAlreadyDeclared" in error:
        return DECLARED_TWICE(
            f"{callback} declares a parameter that is already declared{source}: {error}. A parameter exists as long as "
            "its node.",
            "Declare each parameter once, in `__init__`. A lifecycle node keeps its parameters when it is configured "
            "again.",
        )
    kind = _KINDS.get(event.kind, CALLBACK_EXCEPTION)
    hint = "Begin with the line that raised the error and with the values of its variables." if event.line else ""
    if event.kind == "parameter":
        hint = (
            "To refuse a value, return SetParametersResult(successful=False, reason=…) from the callback that you pass "
            "to `add_on_set_parameters_callback`. An exception ends the node."
        )
        if event.type == "TypeError":
            hint = f"This callback gets every parameter that is set, so check its `name` before its `value`. {hint}"
    hint = _of_goal_state(error) or hint
    if not event.line and "positional argument" in error:
        hint = "It could not be called, because the function takes a different number of arguments than rclpy passes."
    if event.kind == "task" and not event.line:
        hint = "rclpy calls the function that you pass to `add_done_callback` with one argument, the future."
    for exception, known, advice in KNOWN_ERRORS:
        if exception in error and known in (CRASHED, PARAMETER_NOT_DECLARED, PARAMETER_TYPE):
            kind, hint = kind if known is CRASHED else known, advice
    after = _AFTER.get(event.kind, "It ended the spinning.")
    if event.kind == "execute" and _ended_already(error):
        after = "The goal keeps its earlier status, with an empty result; the node continues."
    return kind(f"{callback} raised {error}{source}. {after}", hint)


LATE_BINDING = Kind(
    "late-binding", "callbacks of one lambda, which reads the name of the loop that it is in", Group.CALLBACKS
)


def why_all_alike(scene: Scene) -> Reason | None:
    """Return why callbacks that should do different things all do the same."""
    return first((late_binding,), [inside for inside in scene.insides if inside.alive])


def late_binding(inside: Inside) -> Reason | None:
    """Must have seen: several callbacks from one lambda, and in the source that it reads the variable of its loop."""
    made: dict[str, list[Thing]] = {}
    for thing in inside.callbacks:
        made.setdefault(thing.line, []).append(thing)
    for line, things in made.items():
        number = int(line.rpartition(":")[2] or 0)
        name = inside.source.late_name(number) if number and len(things) > 1 else ""
        if name:
            return LATE_BINDING(
                f"`{inside.name}`, line {number} (`{inside.source.line(number)}`): the lambda reads `{name}` only "
                f"when it runs. By then the loop has ended, so all {len(things)} callbacks use the last value of "
                f"`{name}`.",
                f"Give the lambda the value when it is created: `lambda {name}={name}: ...`. Or use "
                "`functools.partial`.",
            )
    return None
