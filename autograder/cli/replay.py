"""The command `autograder replay`, which shows a student's appeal, runs its check again, and records the answer."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from autograder.cli.app import CourseOption, IsolationOption, app
from autograder.core.errors import KitError
from autograder.core.results import Isolation

if TYPE_CHECKING:
    from rich.console import Console

    from autograder.core.results import CheckResult
    from autograder.course.lab import Lab
    from autograder.grading.appeal import Appeal
    from autograder.graph.recording import BagMessage


@app.command()
def replay(
    file: Annotated[Path, typer.Argument(help="The file that the student has sent.")],
    times: Annotated[
        int, typer.Option(min=0, max=100, help="How often the check is run: first with the same values, then others.")
    ] = 1,
    grant: Annotated[bool, typer.Option("--grant", help="Grant the appeal: the check gets all of its points.")] = False,
    points: Annotated[float | None, typer.Option(help="With --grant: give these points instead.")] = None,
    refuse: Annotated[bool, typer.Option("--refuse", help="Refuse the appeal: the points stay.")] = False,
    reason: Annotated[str, typer.Option(help="The reason for the answer, which the student reads.")] = "",
    sample: Annotated[
        str, typer.Option(metavar="NAME", help="Add the answers as a sample student, for whom the check must pass.")
    ] = "",
    isolation: IsolationOption = Isolation.FULL,
    course: CourseOption = None,
) -> None:
    """Show an appeal with its verdict, timeline and messages, run its check again, and record the answer.

    Nothing in the file is believed: the check is the course's own, and the student is who handed in the answers.
    """
    from autograder.core.history import Decision
    from autograder.course.lab import load_lab
    from autograder.course.paths import course_root
    from autograder.gradebook.appeals import decide, keep, owner
    from autograder.grading.appeal import read_appeal, run_again
    from autograder.grading.runner import Settings
    from autograder.report.terminal import console, plain, working
    from autograder.sandbox.isolation import choose

    root, made = course_root(course), read_appeal(file)
    lab = load_lab(root, made.lab)
    answered = grant or refuse
    _refuse_half_an_answer(grant, refuse, points, reason.strip(), sample)
    who, screen = owner(root, made, lab), console()
    kept = keep(root, file, made)
    _show(screen, made, lab, who)
    for number in range(times):
        seed = made.seed if number == 0 else None
        with working(f"Running {made.check}, {number + 1} of {times}"):
            result, messages = run_again(made, lab, Settings(choose(isolation), seed))
        _show_run(root, screen, result, messages, kept.stem, number)
    if sample:
        from autograder.authoring.sample_student import write_sample_student

        about = f"appeal of {made.made:%Y-%m-%d}: {reason or made.sentence}"
        for path in write_sample_student(root, lab, made, sample, about):
            print(path)
    if not answered:
        _how_to_answer(screen, kept, who)
        return
    if not who:
        raise KitError(
            "Nobody in the class handed in the answers of this file, so the answer is recorded for nobody.",
            "Ask the student to make the file from the notebook that was handed in.",
        )
    decision = Decision.GRANTED if grant else Decision.REFUSED
    for sentence in decide(root, who, made, decision, reason.strip(), points):
        screen.print(plain(sentence), markup=False, soft_wrap=True)


def _refuse_half_an_answer(grant: bool, refuse: bool, points: float | None, reason: str, sample: str) -> None:
    """Look for options that make no answer together, so that none of them is passed over."""
    if grant and refuse:
        raise KitError("An appeal is granted or refused, not both.", "Use --grant or --refuse.")
    if points is not None and not grant:
        raise KitError("`--points` says how many points are granted.", "Add --grant, or leave out --points.")
    if reason and not (grant or refuse or sample):
        raise KitError("`--reason` belongs to an answer.", "Add --grant or --refuse.")
    if (grant or refuse) and not reason:
        raise KitError("An answer needs a reason, which the student reads.", "Add --reason 'SENTENCE'.")


def _how_to_answer(screen: Console, kept: Path, who: str) -> None:
    """Show the command that answers an appeal, if somebody handed in its answers."""
    if who:
        answer = f"autograder replay {shlex.quote(str(kept))} --times 0 --refuse --reason 'SENTENCE'"
        screen.print(f"\nTo answer it: {answer} (or --grant)", markup=False, soft_wrap=True)


def _show(screen: Console, made: Appeal, lab: Lab, who: str) -> None:
    """Show what the student says and saw."""
    from autograder.course.lab import kit_digest
    from autograder.report.terminal import check_view, plain

    same = "this version" if made.kit_digest == kit_digest() else "another version than this"
    varied = f", values: {', '.join(made.seen.varied)}" if made.seen.varied else ""
    lines = [
        f"student   {who or f'nobody handed in these answers; the file says {made.student!r}'}",
        f"check     {made.check} of {made.lab}",
        f"made      {made.made:%Y-%m-%d %H:%M} UTC with kit {made.kit} ({same}), seed {made.seed}{varied}",
        f"says      {made.sentence}",
        f"messages  {_by_topic(made.messages)}",
    ]
    screen.print("\n".join(map(plain, lines)), markup=False, soft_wrap=True)
    screen.print("\nWhat the student saw:")
    screen.print(check_view(made.seen))


def _show_run(
    root: Path, screen: Console, result: CheckResult, messages: list[BagMessage], name: str, number: int
) -> None:
    """Show a run of the course's own check with everything that it found."""
    from autograder.cli.explain import pictures
    from autograder.core.files import write_beside
    from autograder.course.paths import CoursePaths
    from autograder.course.settings import read_book
    from autograder.grading.messages import timeline_of, write_mcap
    from autograder.report.terminal import evidence_view

    folder = CoursePaths(root).explained / "appeals" / name / f"run_{number + 1}"
    screen.print(f"\nRun {number + 1}, with {'the same' if number == 0 else 'other'} values:")
    screen.print(evidence_view(result, read_book(root)))
    for path in pictures([result], folder):
        print(path)
    if result.varied:
        screen.print(f"values    {', '.join(result.varied)}", markup=False)
    screen.print(f"messages  {_by_topic(messages)}", markup=False)
    if messages:
        timeline = folder / "messages.svg"
        write_beside(timeline, timeline_of(result.title or result.grade_id, messages).svg)
        print(timeline)
        try:
            write_mcap(messages, folder / "messages")
        except KitError as error:  # the library for it is not installed
            screen.print(f"{error.what} {error.do}", markup=False)
        else:
            print(next((folder / "messages").glob("*.mcap")))


def _by_topic(messages: list[BagMessage]) -> str:
    from collections import Counter

    counts = Counter((message.topic[:100], message.type[:100]) for message in messages)
    return ", ".join(f"{count} on {topic} ({kind})" for (topic, kind), count in counts.most_common(10)) or "none"
