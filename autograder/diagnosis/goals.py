"""Says why there is no such action, and why a goal of an action did not end as it should.

A fault that does not affect the rest of the node is a reason only for the goals of its action, so it is looked for only
when these goals are diagnosed.
"""

from __future__ import annotations

from collections.abc import Iterator

from autograder.diagnosis.blocked import WRONG_TYPE
from autograder.diagnosis.callbacks import of_event
from autograder.diagnosis.chain import inside_reason
from autograder.diagnosis.inside import Inside, called
from autograder.diagnosis.programs import program_trouble
from autograder.diagnosis.scene import Scene
from autograder.graph.names import nearest, type_name
from autograder.reasons import Group, Kind, Reason
from autograder.sandbox.inside.probe.events import BadMessage, BadReturn, CallbackError, Event, GoalLeft, Thing

NO_CANCEL_CALLBACK = Kind("no-cancel-callback", "the action server has no cancel callback of its own", Group.GOALS)
ACTION_NAME = Kind("action-name", "an action with a similar name is offered", Group.GOALS)
NO_ACTION = Kind("no-action", "no such action, and none similar", Group.GOALS)
NO_FEEDBACK = Kind("no-feedback", "an execute callback ran, and feedback was never published", Group.GOALS)
GOAL_HOLDS_THREAD = Kind(
    "goal-holds-thread",
    "an execute callback that never awaited took its time on the only thread of its executor",
    Group.GOALS,
)
GOAL_HOLDS_GROUP = Kind(
    "goal-holds-group", "an accepted or goal callback took its time in the action server's exclusive group", Group.GOALS
)
NO_SUCCEED = Kind(
    "no-succeed",
    "an execute callback returned although its goal had not ended, so rclpy aborted the goal",
    Group.GOALS,
)

SEND_GOAL = "/_action/send_goal"
"""The end of the name of the service that accepts an action's goals."""

_ENDS = {"succeeded": "succeed()", "canceled": "canceled()", "aborted": "abort()"}
"""The call by which an execute callback sets each status."""

KEPT = 0.3
"""The seconds that a run must have taken to count as one that keeps requests waiting."""


def why_no_action(scene: Scene, name: str, action_type: type) -> Reason:
    """Return why there is no server for an action."""
    trouble = program_trouble(scene)
    if trouble:
        return trouble
    services = scene.observer.services()
    offered = {one.removesuffix(SEND_GOAL): types for one, types in services.items() if one.endswith(SEND_GOAL)}
    wanted = type_name(action_type)
    if name in offered:
        has = offered[name][0].removesuffix("_SendGoal")
        return WRONG_TYPE(f"The action `{name}` has the type {has}, not {wanted}.")
    close = nearest(name, offered)
    if close:
        made = [thing for _, thing in _of_action(scene, close) if thing.kind == "action_server"]
        given = f" (`{made[0].given}` in the code)" if made and made[0].given not in ("", close) else ""
        hint = "A name that begins with a slash stays as it is; without one it follows the node's namespace."
        return ACTION_NAME(
            f"There is no action `{name}`; the nearest name on the graph is `{close}`{given}.",
            hint,
        )
    return inside_reason(scene) or NO_ACTION(f"No node offers the action `{name}`.")


def why_rejected(scene: Scene, name: str) -> Reason | None:
    """Return why a goal was rejected.

    Must have seen: the goal callback raise an exception, or return something other than a GoalResponse.
    """
    return _said(scene, name, "goal")


def why_not_finished(scene: Scene, name: str, status: str = "succeeded") -> Reason | None:
    """Return why a goal did not end with this status, or did not end at all.

    Must have seen: an error leave the execute callback, its result refused, or a return without the goal's end.
    """
    found = _said(scene, name, "execute")
    if found:
        return found
    for inside, _ in _of_action(scene, name):
        for event in inside.all(GoalLeft):
            if event.name == name:
                return NO_SUCCEED(
                    f"The execute callback of `{inside.name}` ({event.line}) returned without setting the status of "
                    "the goal, so rclpy aborts the goal.",
                    f"Call `goal_handle.{_ENDS[status]}` before `return`, because a result alone does not set the "
                    "status of the goal.",
                )
    return None


def why_no_result(scene: Scene, name: str) -> Reason | None:
    """Return why a goal that has ended got an empty result.

    Must have seen: an error leave the execute callback, or its feedback or result refused.
    """
    return _said(scene, name, "execute")


def why_no_feedback(scene: Scene, name: str) -> Reason | None:
    """Return why no feedback came.

    Must have seen: an error in the execute callback; or an execute callback that ran, and no feedback published. While
    the callback is running, what is wrong inside a program comes first, because that can hold the feedback back.
    """
    found = _said(scene, name, "execute")
    if found:
        return found
    things = list(_of_action(scene, name))
    servers = [thing for _, thing in things if thing.kind == "action_server"]
    for inside, thing in things:
        if thing.kind == "execute" and thing.runs and servers and not any(server.runs for server in servers):
            blocked = inside_reason(scene) if thing.running else None
            return blocked or NO_FEEDBACK(
                f"`{inside.name}`: {called(thing)} {'runs' if thing.running else 'has run'}, and no feedback was "
                "published.",
                _how_to_publish(inside),
            )
    return None


def _how_to_publish(inside: Inside) -> str:
    """Return what to do if no feedback was published, which depends on whether the source calls for it at all."""
    number = inside.source.calls("publish_feedback")
    if not number:
        return "`goal_handle.publish_feedback(...)` sends one feedback message; call it in the loop."
    return (
        f"Line {number} (`{inside.source.line(number)}`) should publish feedback. Look at what the callback does "
        "before this line, and whether it gets there."
    )


def why_wrong_feedback(scene: Scene, name: str) -> Reason | None:
    """Return why the feedback has other values than expected.

    Must have seen: a field of the feedback whose value is not of the field's type.
    """
    for inside in dict.fromkeys(inside for inside, _ in _of_action(scene, name)):
        for event in inside.all(BadMessage):
            if event.kind == "feedback" and event.name == name:
                return of_event(inside, event)
    return None


def why_not_canceled(scene: Scene, name: str) -> Reason | None:
    """Return why a server did not agree to cancel a goal, or agreed too late."""
    return _said(scene, name, "cancel") or _no_cancel_callback(scene, name) or why_waits_for_a_goal(scene, name)


def _no_cancel_callback(scene: Scene, name: str) -> Reason | None:
    """Must have seen: the action's server, and no cancel callback that the student gave it."""
    things = list(_of_action(scene, name))
    kinds = {thing.kind for _, thing in things}
    if not things or "action_server" not in kinds or "cancel" in kinds or not things[0][0].attached:
        return None
    return NO_CANCEL_CALLBACK(
        f"`{things[0][0].name}`: the action server of `{name}` was created without a cancel callback, and rclpy's "
        "default callback refuses every request to cancel.",
        "Pass one that returns CancelResponse.ACCEPT: `ActionServer(..., cancel_callback=...)`.",
    )


def why_waits_for_a_goal(scene: Scene, name: str) -> Reason | None:
    """Return why a request or a timer waits while a goal is executed.

    Must have seen: a long run of the execute callback that did not await anything, and an executor with one thread; or
    a long run of the accepted or goal callback, in the server's exclusive group.
    """
    for inside, thing in _of_action(scene, name):
        if not inside.attached or not _lasts(inside, thing):
            continue
        executor = inside.executor_of(thing.node)
        if thing.kind == "execute" and executor and executor.size == 1 and not thing.awaited:
            alone = " `async` alone does not change this, because only `await` frees the thread." * (
                "async " in thing.code
            )
            return GOAL_HOLDS_THREAD(
                f"`{inside.name}`: {called(thing)} occupies the only thread of its {executor.type} until it returns. "
                "Meanwhile, the node runs no timer, takes no new goal and takes no request to cancel." + alone,
                "Give it two threads or more: `MultiThreadedExecutor(num_threads=2)`."
                if executor.type == "MultiThreadedExecutor"
                else "Add the node to a MultiThreadedExecutor(num_threads=...) and spin that.",
            )
        if thing.kind in ("accepted", "goal") and thing.exclusive:
            return GOAL_HOLDS_GROUP(
                f"`{inside.name}`: {called(thing)} takes a long time, and the action server is in a mutually exclusive "
                "group. Until the callback returns, the server takes no other goal and no request to cancel.",
                "Let this callback return immediately: `goal_handle.execute()` starts the execute callback, which may "
                "take a long time.",
            )
    return None


def _lasts(inside: Inside, thing: Thing) -> bool:
    return any(inside.now - began > KEPT for began, _ in thing.running) or thing.spent > KEPT * max(thing.done, 1)


def _of_action(scene: Scene, name: str) -> Iterator[tuple[Inside, Thing]]:
    """Yield what the probes know about an action's servers and their callbacks."""
    for inside in scene.insides:
        for thing in inside.things.values():
            if thing.name == name and thing.kind in ("action_server", "execute", "goal", "cancel", "accepted"):
                yield inside, thing


def _said(scene: Scene, name: str, kind: str) -> Reason | None:
    """Return the reason if a program reports an error in one of the action's callbacks."""
    for inside in dict.fromkeys(inside for inside, _ in _of_action(scene, name)):
        for event in inside.events:
            found = of_event(inside, event) if _about(event, kind, name) else None
            if found:
                return found
    return None


def _about(event: Event, kind: str, name: str) -> bool:
    if isinstance(event, BadMessage):
        return kind == "execute" and event.kind in ("feedback", "result") and event.name == name
    if isinstance(event, CallbackError):
        return event.kind == kind and event.name == name
    return isinstance(event, BadReturn) and event.kind == kind
