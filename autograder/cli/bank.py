"""The commands `autograder bank add`, `check`, `show` and `explain`, for the bank of past terms."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from autograder.cli.app import CourseOption, IsolationOption, app
from autograder.core.errors import KitError
from autograder.core.results import Isolation

bank = typer.Typer(no_args_is_help=True)
app.add_typer(bank, name="bank", help="Keep answers of past terms, and find out whether they still get their points.")

LabArgument = Annotated[str, typer.Argument(help="The lab, such as lab2_executors.")]
EntryArgument = Annotated[str, typer.Argument(help="The entry, as `bank check` lists it.")]
CheckArgument = Annotated[str, typer.Argument(help="The check, by its id.")]


@bank.command("add")
def add_class(lab: LabArgument, course: CourseOption = None) -> None:
    """Add the graded class of a lab to the folder `bank`: programs and files without names, with their final points."""
    from autograder.authoring.bank import add
    from autograder.course.paths import CoursePaths, course_root
    from autograder.intake.words import count

    root = course_root(course)
    added = add(root, lab)
    print(f"Added {_entries(added.entries)} to {CoursePaths(root).bank(lab)}.")
    if added.known:
        print(f"The answers of {count(added.known, 'student')} are there already.")
    if added.unreadable:
        print(f"The notebook of {count(added.unreadable, 'student')} cannot be read, and is not in the bank.")


@bank.command("check")
def check_bank(
    lab: Annotated[str | None, typer.Argument(help="The lab; default: all labs in the bank.")] = None,
    isolation: IsolationOption = Isolation.FULL,
    jobs: Annotated[int, typer.Option(min=0, help="How many entries run at once; 0: depends on the CPUs.")] = 0,
    course: CourseOption = None,
) -> None:
    """Run today's checks on all entries, and list every difference.

    Exit status: 0; 1 if a difference is unexplained, or if the machine was too busy for a check.
    """
    from autograder.authoring.bank import check
    from autograder.course.lab import lab_names
    from autograder.course.paths import CoursePaths, course_root
    from autograder.grading.runner import Settings
    from autograder.intake.words import count
    from autograder.report.terminal import plain
    from autograder.sandbox.isolation import choose

    root = course_root(course)
    names = [lab] if lab else [name for name in lab_names(root) if CoursePaths(root).bank(name).is_dir()]
    if not names:
        raise KitError("The bank is empty.", "Add a graded class: autograder bank add LAB")
    settings = Settings(isolation=choose(isolation), jobs=jobs)
    bad = too_busy = 0
    for name in names:
        found = check(root, name, settings)
        for one in found.differences:
            bad += 1
            print(
                plain(": ".join(filter(None, (f"{name} {one.entry} {one.check}", "; ".join(one.changes), one.because))))
            )
        differ = count(len(found.differences), "difference")
        print(f"{name}: {_entries(found.entries)}, {differ} that nobody has explained", file=sys.stderr)
        too_busy += len(found.too_busy)
        for check_id, times in found.too_busy.items():
            print(plain(f"{name} {check_id}: not decided in {_entries(times)}, because the machine was too busy."))
        for check_id, times in found.never_decided.items():
            why = "because it had no points when they were added"
            print(plain(f"{name} {check_id}: not compared in {_entries(times)}, {why}."))
        for check_id in found.untried:
            print(plain(f"{name} {check_id}: no entry has points of it, so the bank says nothing about this check."))
    if bad:
        print(
            "Look at the programs of an entry: autograder bank show LAB ENTRY CHECK\n"
            "Then correct the check, or say why it is right: autograder bank explain LAB ENTRY CHECK REASON",
            file=sys.stderr,
        )
    if too_busy:
        print("Run it again when the machine has less to do, or with fewer entries at once: --jobs 1", file=sys.stderr)
    raise typer.Exit(1 if bad or too_busy else 0)


@bank.command("show")
def show_programs(lab: LabArgument, entry: EntryArgument, check: CheckArgument, course: CourseOption = None) -> None:
    """Print the programs and files of an entry that a check looks at."""
    from autograder.authoring.bank import programs
    from autograder.course.paths import course_root
    from autograder.report.terminal import plain

    print(plain("\n\n".join(programs(course_root(course), lab, entry, check).values())))


@bank.command("explain")
def explain_difference(
    lab: LabArgument,
    entry: Annotated[
        str, typer.Argument(help="The entry, as `bank check` lists it; `all` for all entries in its list.")
    ],
    check: CheckArgument,
    reason: Annotated[str, typer.Argument(help="Why today's verdict is right.")],
    course: CourseOption = None,
) -> None:
    """Record why today's verdict is right. `bank check` lists the entry again if its verdict changes once more."""
    from autograder.authoring.bank import explain
    from autograder.course.paths import course_root
    from autograder.intake.words import count

    print(f"Explained {count(explain(course_root(course), lab, entry, check, reason), 'difference')}.")


def _entries(number: int) -> str:
    return f"{number} {'entry' if number == 1 else 'entries'}"
