"""Keep the history of every submission's points in the gradebook, in a table of the kit's own that only grows.

An entry is written whenever points are recorded or a feedback page is made, and whenever a person gives points in
formgrader, in the same transaction as these points.
"""

from __future__ import annotations

import datetime
import getpass
import hashlib
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from autograder.core.history import Decided, Entry, Graded, decisions, state_after
from autograder.core.version import VERSION
from autograder.course.lab import Lab, kit_digest
from autograder.gradebook import own_tables
from autograder.gradebook.queries import points_in
from autograder.submission import timestamp
from autograder.submission.reader import read_submission

if TYPE_CHECKING:
    from sqlalchemy.engine import Connection
    from sqlalchemy.orm import Session


def note_graded(connection: Connection, lab: Lab, student: str, notebook: Path) -> None:
    """Add an entry if a submission was graded since the last one, or if its points changed.

    Args:
        connection: the gradebook, in a transaction.
        lab: the lab.
        student: the student who handed it in.
        notebook: the submitted notebook.
    """
    state = state_after(own_tables.history(connection, lab.name, student).get(student, []))
    points, penalty = points_in(connection, lab.name, student)
    changed = {name: found for name, found in points.items() if found != state.points.get(name)}
    recorded = own_tables.recorded(connection, lab.name, student).get(student, "")
    is_new = state.graded is None or state.graded.recorded != recorded
    if changed or penalty != state.penalty or is_new:
        entry = Entry(
            at=_now(),
            by=user(),
            points=changed,
            penalty=penalty if penalty != state.penalty else None,
            graded=_graded(lab, notebook, recorded) if is_new else None,
        )
        own_tables.note_history(connection, lab.name, student, entry)


def note_decided(talks: Session | Connection, lab: str, student: str, decided: Decided, given: float | None) -> None:
    """Add the answer to an appeal, and the points that it gives, as one entry.

    The points have to be given after this. They are then noted already, so `watch_people` adds no second entry.

    Args:
        talks: the gradebook, in a transaction.
        lab: the lab.
        student: the student.
        decided: the answer.
        given: the points that the check gets; None if its points stay.
    """
    entries = own_tables.history(talks, lab, student).get(student, [])
    before = state_after(entries).points.get(decided.cell)
    now = before if before is None or given is None else before.model_copy(update={"by_hand": given})
    points = {} if now is None or now == before else {decided.cell: now}
    if not points and decisions(entries).get(decided.cell) == decided:  # the same command once more
        return
    own_tables.note_history(talks, lab, student, Entry(at=_now(), by=user(), points=points, decided=decided))


def watch_people() -> None:
    """From now on, note the points that a person gives through nbgrader in this process, such as in formgrader."""
    from sqlalchemy import event
    from sqlalchemy.orm import Session

    if not event.contains(Session, "before_flush", _note_people):
        event.listen(Session, "before_flush", _note_people)


def user() -> str:
    """Return the name of the user at work, which is also the hub's name for the user on a JupyterHub."""
    return os.environ.get("JUPYTERHUB_USER") or getpass.getuser()


def _note_people(session: Any, *_: object) -> None:
    from nbgrader.api import Grade
    from sqlalchemy import inspect

    for grade in [one for one in session.dirty if isinstance(one, Grade)]:
        if not any(inspect(grade).attrs[name].history.has_changes() for name in ("manual_score", "extra_credit")):
            continue
        submitted = grade.notebook.assignment
        lab, student = submitted.assignment.name, submitted.student_id
        own_tables.make_tables(session.connection())
        state = state_after(own_tables.history(session, lab, student).get(student, []))
        before = state.points.get(grade.cell.name)
        if before is None:  # it was graded by an earlier version of the kit, and the next entry will hold everything
            continue
        now = before.model_copy(update={"by_hand": grade.manual_score, "extra": grade.extra_credit})
        if now != before:
            entry = Entry(at=_now(), by=user(), points={grade.cell.name: now})
            own_tables.note_history(session, lab, student, entry)


def _graded(lab: Lab, notebook: Path, recorded: str) -> Graded:
    submission = read_submission(notebook, lab)
    own = {name: text for name, text in submission.files.items() if name not in lab.given}
    handed_in = notebook.with_name(timestamp.FILE_NAME)
    stamp = handed_in.read_bytes()[: timestamp.MOST_BYTES] if handed_in.is_file() else b""
    return Graded(
        kit=VERSION,
        kit_digest=kit_digest(),
        lab_digest=lab.source_digest,
        checks={cell.grade_id: hashlib.sha256(cell.source.encode()).hexdigest()[:16] for cell in lab.checks},
        answers=own_tables.digest_of(submission.sources, own),
        handed_in=(timestamp.moment(stamp) if stamp else "") or "",
        recorded=recorded,
    )


def _now() -> datetime.datetime:
    return datetime.datetime.now(datetime.UTC).replace(microsecond=0)
