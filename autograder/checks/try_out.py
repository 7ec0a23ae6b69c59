"""`launch(…)` as the last line of a cell: the programs run for a moment, and the cell says what there was to see."""

from __future__ import annotations

from collections.abc import Sequence

from autograder.checks.running import Running
from autograder.core.output import tidy
from autograder.graph.names import node_of
from autograder.sandbox.running_program import RunningProgram

TRIAL = 3.0
"""Seconds for which the programs run."""

_OWN = ("/rosout", "/parameter_events")


class Log(str):
    """What programs printed; a notebook shows it as it is."""

    __slots__ = ()

    def __repr__(self) -> str:
        return self or "(nothing was printed)"


def log_of(programs: Sequence[RunningProgram], name: str) -> Log:
    """Return what the programs of a launch have printed so far, or one of them."""
    chosen = [program for program in programs if name in ("", program.name)]
    many = len(chosen) > 1
    return Log("\n".join(f"--- {p.name}\n{tidy(p.output())}" if many else tidy(p.output()).rstrip() for p in chosen))


def try_out(running: Running) -> str:
    """Let a launch run for a few seconds, while its programs print, and tell what was on the graph."""
    observer = running.observer
    observer.wait(running.all_ended, TRIAL)
    if running.all_ended():
        ends = [f"{p.name} ended with exit status {p.exit_status()}" for _, p in running.programs]
        return "; ".join(ends) + "."
    nodes = observer.nodes()
    lines = [f"After {TRIAL:g} s: " + (f"the nodes {', '.join(nodes)}" if nodes else "no node") + "."]
    for verb, ends_of in (("publishes", observer.publishers), ("subscribes to", observer.subscriptions)):
        for topic, types in sorted(observer.topics().items()):
            owners = sorted({node_of(end) for end in ends_of(topic)})
            if owners and topic not in _OWN:
                lines.append(f"  {', '.join(owners)} {verb} {topic} ({', '.join(types)})")
    return "\n".join(lines)
