"""Why something did not happen: walks the chain from the program to the message and names the first broken link.

    program started? → still alive? → node name? → namespace? → topic name? → message type? → QoS pair?
    → error in a callback? → blocked callback? → spun at all? → lifecycle state? → timer due? → kept waiting by others?

A link speaks only if what its docstring demands has been seen; a reason is established or not given. Where no link
speaks, the report says what was observed, and so ruled out, without advice.

What the graph shows is evidence. What the student's process says about itself (its output, its probe's events, its
threads' stacks) is used here for the *reason* only; points never depend on it, but for one thing: of a program that
has ended, what was seen before stands where its probe tells that the check's own message or request ended it.
"""

from autograder.diagnosis.callbacks import called_from_outside, failed_in_a_callback, why_all_alike
from autograder.diagnosis.chain import inside_reason, reason_inside
from autograder.diagnosis.goals import (
    why_no_action,
    why_no_feedback,
    why_no_result,
    why_not_canceled,
    why_not_finished,
    why_rejected,
    why_waits_for_a_goal,
    why_wrong_feedback,
)
from autograder.diagnosis.names import why_doubled, why_no_endpoint, why_no_node, why_no_service, why_topic_present
from autograder.diagnosis.programs import program_trouble, shut_down_inside, thread_left
from autograder.diagnosis.scene import Scene
from autograder.diagnosis.silence import (
    SILENT,
    account,
    lifecycle_silence,
    nothing_due,
    paces,
    why_no_answer,
    why_not_matched,
    why_silent,
)
from autograder.diagnosis.together import (
    layout,
    sent_nothing,
    waits_for_its_group,
    why_kept_waiting,
    why_not_together,
    why_starved,
)
from autograder.diagnosis.traces import last_traceback

__all__ = [
    "SILENT",
    "Scene",
    "account",
    "called_from_outside",
    "failed_in_a_callback",
    "inside_reason",
    "last_traceback",
    "layout",
    "lifecycle_silence",
    "nothing_due",
    "paces",
    "program_trouble",
    "reason_inside",
    "sent_nothing",
    "shut_down_inside",
    "thread_left",
    "waits_for_its_group",
    "why_all_alike",
    "why_doubled",
    "why_kept_waiting",
    "why_no_action",
    "why_no_answer",
    "why_no_endpoint",
    "why_no_feedback",
    "why_no_node",
    "why_no_result",
    "why_no_service",
    "why_not_canceled",
    "why_not_finished",
    "why_not_matched",
    "why_not_together",
    "why_rejected",
    "why_silent",
    "why_starved",
    "why_topic_present",
    "why_waits_for_a_goal",
    "why_wrong_feedback",
]
