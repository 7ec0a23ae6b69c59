"""`launch(…)` as the last line of a cell: the programs run for a moment, and the cell says what there was to see."""

from __future__ import annotations

from contextlib import AbstractContextManager

from autograder.checks.expect.expectations import ExpectationBase
from autograder.checks.waiting import NotLaunchedError
from autograder.core.output import tidy
from autograder.graph.names import full_name

TRIAL = 3.0
"""Seconds for which the programs run."""

_OWN = ("/rosout", "/parameter_events")


class Log(str):
    """What programs printed; a notebook shows it as it is."""

    __slots__ = ()

    def __repr__(self) -> str:
        return self or "(nothing was printed)"


def log_of(launch: ExpectationBase, name: str) -> Log:
    """Return what the programs of a launch have printed so far, or one of them."""
    chosen = [program for _, program in launch.programs if name in ("", program.name)]
    many = len(chosen) > 1
    return Log("\n".join(f"--- {p.name}\n{tidy(p.output())}" if many else tidy(p.output()).rstrip() for p in chosen))


def try_out(launch: AbstractContextManager[ExpectationBase]) -> None:
    """Run the launch for a few seconds, show what its programs print, and say what was on the graph."""
    try:
        with launch as ros:
            ros.observer.wait(ros.all_ended, TRIAL)
            seen = _seen(ros)
    except NotLaunchedError as reason:
        print(reason)
        return
    names = ", ".join(f'"{node.program}"' for node in ros.nodes)
    print(f"{seen}\nTo look closer: with launch({names}) as ros: …")


def _seen(launch: ExpectationBase) -> str:
    observer = launch.observer
    nodes = observer.nodes()
    if launch.all_ended():
        ends = [f"{p.name} ended with exit status {p.exit_status()}" for _, p in launch.programs]
        return "; ".join(ends) + "."
    lines = [f"After {TRIAL:g} s: " + (f"the nodes {', '.join(nodes)}" if nodes else "no node") + "."]
    for verb, ends_of in (("publishes", observer.publishers), ("subscribes to", observer.subscriptions)):
        for topic, types in sorted(observer.topics().items()):
            owners = sorted({full_name(end.node_namespace, end.node_name) for end in ends_of(topic)})
            if owners and topic not in _OWN:
                lines.append(f"  {', '.join(owners)} {verb} {topic} ({', '.join(types)})")
    return "\n".join(lines)
