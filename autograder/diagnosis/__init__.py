"""Says why something did not happen: follows the chain from the program to the message and names the first broken link.

    program started? → still alive? → node name? → namespace? → topic name? → message type? → QoS pair?
    → error in a callback? → blocked callback? → spun at all? → lifecycle state? → timer due? → kept waiting by others?

A link gives a reason only if everything that its docstring requires has been seen, so every reason is established. If
no link gives a reason, the report says what was observed, and therefore ruled out, without advice.

What the graph shows is evidence. What the student's process says about itself (its output, its probe's events, its
threads' stacks) is used here for the *reason* only, and points do not depend on it. There is one exception: after a
program has ended, what was seen before still counts if its probe shows that the check's own message or request ended
the program.
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
