"""Every file to its owner: classes of every form, in which students chose unlucky and hostile names."""

from __future__ import annotations

import os
import shutil
from collections import Counter
from pathlib import Path

import class_forms
import pytest
import toy

from autograder.core.errors import KitError
from autograder.intake.collect import Collected, collect
from autograder.intake.members import MOST
from autograder.intake.options import Accepted


def test_nobody_is_lost_swapped_or_replaced(request: pytest.FixtureRequest) -> None:
    number = 10_000 if request.config.getoption("--complete") else 250
    became: Counter[str] = Counter()
    wrong = []
    for seed in range(number):
        made, what, found = class_forms.tried(seed)
        became[f"{'hostile' if made.hostile else 'honest'} {what.split(':')[0]}"] += 1
        wrong += [f"{seed} ({made.form}): {sentence}" for sentence in found]
    assert wrong == []
    assert became["honest whole"] > 4 * (became["honest stopped"] + became["honest left out"])
    assert became["hostile whole"] > became["hostile stopped"] + became["hostile left out"]


PLAIN = {f"{n}/toy.ipynb": n.encode() for n in ("ann", "bob", "cem", "dan", "eve", "fay")}
CANVAS = {f"{n}_{i}_{900 + i}_toy.ipynb": n.encode() for i, n in ((111, "ann"), (222, "bob"), (333, "cem"))}
MOODLE = {
    f"{n}_{i}_assignsubmission_file_/toy.ipynb": n.encode() for i, n in ((501, "ann"), (502, "bob"), (503, "cem"))
}
BLACKBOARD = {f"Lab_{n}_attempt_2026-11-19-10-00-00_toy.ipynb": n.encode() for n in ("ann", "bob", "cem")}
METADATA = b"submission_1:\n  :submitters:\n  - :name: ann\nsubmission_2:\n  :submitters:\n  - :name: bob\n"
SWAPPED = METADATA.replace(b"ann", b"x").replace(b"bob", b"ann").replace(b"x", b"bob")
GRADESCOPE = {"submission_1/toy.ipynb": b"ann", "submission_2/toy.ipynb": b"bob"}


def many(form: str) -> dict[str, bytes]:
    return {form.format(i): b"evil" for i in range(30)}


HOSTILE = {
    "plain: a Canvas name in a folder": (PLAIN | {"eve/ann_222_999_toy.ipynb": b"evil"}, 6),
    "plain: an innocent my_1_2_notes.ipynb": (PLAIN | {"eve/my_1_2_notes.ipynb": b"x"}, 6),
    "plain: hw_1_2_x.zip with a notebook": (PLAIN | {"eve/hw_1_2_x.zip": class_forms.zipped({"n.ipynb": b"x"})}, 6),
    "plain: a Moodle folder inside": (PLAIN | {"eve/Ann_501_assignsubmission_file_/toy.ipynb": b"evil"}, 6),
    "plain: an exchange folder inside": (PLAIN | {"eve/ann+toy+2026-12-19 10:00:00 UTC+a/toy.ipynb": b"evil"}, 6),
    "plain: repositories inside": (
        PLAIN | {"eve/toy-ann/labs/toy/toy.ipynb": b"evil", "eve/toy-bob/labs/toy/toy.ipynb": b"evil"},
        6,
    ),
    "plain: Blackboard's form inside": (PLAIN | {"eve/Lab_ann_attempt_2026-12-20-18-30-00_toy.ipynb": b"evil"}, 6),
    "plain: submitted/ inside": (PLAIN | {"eve/submitted/ann/toy/toy.ipynb": b"evil"}, 6),
    "plain: submission_metadata.yml and folders inside": (
        PLAIN | {"eve/submission_metadata.yml": METADATA, "eve/submission_1/toy.ipynb": b"evil"},
        6,
    ),
    "plain: thirty Moodle names inside": (PLAIN | many("eve/s{0}_{0}_assignsubmission_file_/toy.ipynb"), 6),
    "canvas: another's name in a zip": (
        CANVAS | {"eve_444_955_work.zip": class_forms.zipped({"ann_111_999_toy.ipynb": b"evil"})},
        4,
    ),
    "canvas: thirty Moodle names in a zip": (
        CANVAS | {"eve_444_955_work.zip": class_forms.zipped(many("s{0}_{0}_assignsubmission_file_toy.ipynb"))},
        -3,
    ),
    "canvas: an upload in Moodle's form": (CANVAS | {"eve_444_955_ann_501_assignsubmission_file_toy.ipynb": b"eve"}, 4),
    "canvas: a re-upload with numbers in it": (CANVAS | {"eve_444_955_ann_111_999_toy.ipynb": b"eve"}, 4),
    "canvas: a zip in a zip": (
        CANVAS
        | {
            "eve_444_955_work.zip": class_forms.zipped(
                {"a.zip": class_forms.zipped({"ann_111_999_toy.ipynb": b"evil"})}
            )
        },
        4,
    ),
    "moodle: another's folder in a folder": (
        MOODLE | {"eve_504_assignsubmission_file_/ann_501_assignsubmission_file_/toy.ipynb": b"evil"},
        4,
    ),
    "moodle: another's folder in a zip": (
        MOODLE
        | {
            "eve_504_assignsubmission_file_/w.zip": class_forms.zipped(
                {"ann_501_assignsubmission_file_toy.ipynb": b"evil"}
            )
        },
        4,
    ),
    "moodle, flat: another's form in a file name": (
        {k.replace("_/", "_"): v for k, v in MOODLE.items()}
        | {"eve_504_assignsubmission_file_ann_501_assignsubmission_file_toy.ipynb": b"evil"},
        -3,
    ),
    "blackboard: a later attempt in a zip": (
        BLACKBOARD
        | {
            "Lab_eve_attempt_2026-11-19-10-00-00_w.zip": class_forms.zipped(
                {"Lab_ann_attempt_2026-12-19-10-00-00_toy.ipynb": b"evil"}
            )
        },
        4,
    ),
    "gradescope: metadata of a student's": (
        GRADESCOPE | {"submission_metadata.yml": METADATA, "submission_1/submission_metadata.yml": SWAPPED},
        2,
    ),
    "gradescope: metadata in a hidden-first folder, in a zip": (
        {"submission_1/submission_metadata.yml": SWAPPED} | GRADESCOPE | {"submission_metadata.yml": METADATA},
        2,
    ),
    "exchange: another's folder inside": (
        {f"{n}+toy+2026-11-19 10:00:00 UTC+a/toy.ipynb": n.encode() for n in ("ann", "bob")}
        | {"eve+toy+2026-11-19 10:00:00 UTC+a/ann+toy+2027-11-19 10:00:00 UTC+a/toy.ipynb": b"evil"},
        3,
    ),
    "submitted: submitted/ inside": (
        {f"submitted/{n}/toy/toy.ipynb": n.encode() for n in ("ann", "bob")}
        | {"submitted/eve/toy/submitted/ann/toy/toy.ipynb": b"evil"},
        3,
    ),
    "canvas: a late one added by hand": (CANVAS | {"pat.ipynb": b"pat", "dan/lab.ipynb": b"dan"}, 5),
    "canvas: a name with lines": (CANVAS | {"van_dyke_jan_123_456_toy.ipynb": b"van_dyke_jan"}, 4),
    "drive: lab.ipynb and lab (1).ipynb": ({"toy.ipynb": b"a", "toy (1).ipynb": b"b", "ann.ipynb": b"ann"}, -1),
    "only a checkpoint": (PLAIN | {"zoe/.ipynb_checkpoints/toy-checkpoint.ipynb": b"zoe"}, -6),
}


@pytest.mark.parametrize("zipped", [False, True], ids=["folder", "zip"])
@pytest.mark.parametrize(("files", "number"), HOSTILE.values(), ids=HOSTILE)
def test_what_a_student_calls_a_file_makes_nobody_vanish(
    tmp_path: Path, files: dict[str, bytes], number: int, zipped: bool
) -> None:
    """The work of each is the name; a negative number: so many at the least, and a sentence about the rest."""
    try:
        collected = collect(class_forms.lay_out(files, tmp_path, zipped), class_forms.LAB, tmp_path / "course")
    except KitError:
        assert not (tmp_path / "course").exists()
        return
    taken = {name: path.read_text(encoding="utf-8") for name, path in collected.notebooks.items()}
    assert all(name in ("eve", text) for name, text in taken.items())
    assert collected.refused or len(taken) >= number
    assert number > 0 or (collected.refused and len(taken) >= -number)


def taken_from(files: dict[str, bytes], tmp_path: Path, *accepted: Accepted) -> tuple[dict[str, str], Collected]:
    """What is taken from a class in a folder, by student, and what is said."""
    source = class_forms.lay_out(files, tmp_path, False)
    collected = collect(source, class_forms.LAB, tmp_path / "course", accepted=accepted)
    return {name: path.read_text(encoding="utf-8") for name, path in collected.notebooks.items()}, collected


EXCHANGE = {f"{n}+toy+2026-11-19 10:00:00 UTC+a/toy.ipynb": n.encode() for n in ("ann", "bob")}
TWICE = {
    "a folder and its zip": {
        "ann/toy.ipynb": b"1",
        "ann.zip": class_forms.zipped({"toy.ipynb": b"2"}),
        "bob.ipynb": b"b",
    },
    "a folder and a file": {"ann/toy.ipynb": b"1", "ann.ipynb": b"2", "bob.ipynb": b"b"},
    "with and without the lab's name": {"toy_ann.ipynb": b"1", "ann.ipynb": b"2", "bob.ipynb": b"b"},
    "by hand beside Canvas": CANVAS | {"ann.ipynb": b"2"},
    "by hand beside Blackboard": BLACKBOARD | {"ann.ipynb": b"2"},
    "by hand beside the exchange": EXCHANGE | {"ann/toy.ipynb": b"2"},
    "by hand beside submitted": {f"submitted/{n}/toy/toy.ipynb": n.encode() for n in ("ann", "bob")}
    | {"submitted/ann.ipynb": b"2"},
}


@pytest.mark.parametrize("files", TWICE.values(), ids=TWICE)
def test_nobody_is_replaced_by_an_entry_of_which_nothing_says_that_it_is_later(
    tmp_path: Path, files: dict[str, bytes]
) -> None:
    with pytest.raises(KitError, match="belong to the same student, 'ann', and it is not clear which"):
        taken_from(files, tmp_path)
    assert not (tmp_path / "course").exists()
    taken, collected = taken_from(files, tmp_path, Accepted.REPLACED)
    assert "bob" in taken and len(taken) == collected.students
    assert "the second was left out" in collected.refused[0]
    by_hand = any("+" in name or "_" in name or "/" in name for name in files) and "ann/toy.ipynb" not in files
    assert taken["ann"] in ("1", "2") and (not by_hand or "toy_ann.ipynb" in files or taken["ann"] == "2")


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files to somebody else")
def test_nobody_hands_in_as_somebody_else_in_nbgraders_exchange(tmp_path: Path) -> None:
    """Its folder `inbound` takes folders of all users, with any name: here two accounts that every machine has."""
    honest = [(name, f"{name}+toy+2026-11-20 10:00:00 UTC+a") for name in ("daemon", "bin")]
    forged = "daemon+toy+2026-12-24 10:00:00 UTC+b"
    for name, folder in (*honest, ("bin", forged), ("bin", forged.replace("toy", "another"))):
        (tmp_path / "inbound" / folder).mkdir(parents=True)
        (tmp_path / "inbound" / folder / "toy.ipynb").write_text("the work of daemon" if folder != forged else "evil")
        shutil.chown(tmp_path / "inbound" / folder, name)
    collected = collect(tmp_path / "inbound", toy.LAB, tmp_path / "course")
    assert {name: path.read_text() for name, path in collected.notebooks.items()} == dict.fromkeys(
        ("daemon", "bin"), "the work of daemon"
    )
    assert collected.refused == [f"'{forged}' belongs to the account 'bin'. It was left out."]


def test_whatever_lies_among_nbgraders_folders_is_taken_or_named(tmp_path: Path) -> None:
    many = {f"submitted/mal/toy/{number}.txt": b"" for number in range(MOST + 1)}
    files = {"submitted/ann/toy/toy.ipynb": b"ann", "submitted/bob/other/other.ipynb": b"for another lab"}
    files |= {"submitted/pat.ipynb": b"pat", "submitted/zoe.zip": class_forms.zipped({"toy.ipynb": b"zoe"})}
    files |= {"submitted/eve/toy.ipynb": b"eve", **many}
    (tmp_path / "in" / "submitted").mkdir(parents=True)
    (tmp_path / "in" / "submitted" / "lin").symlink_to("ann")
    taken, collected = taken_from(files, tmp_path)
    assert taken == {name: name for name in ("ann", "eve", "pat", "zoe")}
    told = "\n".join(collected.refused)
    assert "'mal' cannot be the work of one student" in told and "lin is a link" in told and len(collected.refused) == 2


def test_too_many_files_are_said_however_often_they_are_looked_at(tmp_path: Path) -> None:
    files = {f"a-mal/{number}.txt": b"" for number in range(MOST + 1)} | {"a-bob/labs/toy/toy.ipynb": b"bob"}
    taken, collected = taken_from(files, tmp_path)  # first as what Classroom 50 downloads
    assert taken == {"a-bob": "bob"} and "'a-mal' cannot be the work of one student" in collected.refused[0]


BROKEN = b"PK\x03\x04 and no more"
BESIDE = {
    "a damaged zip": {"ann_1_11_pics.zip": BROKEN},
    "a zip of other notebooks": {"ann_1_11_more.zip": class_forms.zipped({"a.ipynb": b"a", "b.ipynb": b"b"})},
    "a zip whose names lead out of it": {"ann_1_11_out.zip": class_forms.zipped({"../toy.ipynb": b"x"})},
}


@pytest.mark.parametrize("more", BESIDE.values(), ids=BESIDE)
def test_a_file_that_nobody_understands_costs_no_good_notebook(tmp_path: Path, more: dict[str, bytes]) -> None:
    taken, collected = taken_from({"ann_1_10_toy.ipynb": b"good", "bob_2_12_toy.ipynb": b"bob", **more}, tmp_path)
    (name,) = more
    assert taken == {"ann": "good", "bob": "bob"} and not collected.refused
    assert f"{name!r}, which " in collected.line and "'ann_1_10_toy.ipynb' of 'ann' counts" in collected.line
    assert "empty zip" not in collected.line


def test_where_the_labs_notebook_may_be_in_what_nobody_understands_a_person_decides(tmp_path: Path) -> None:
    files = {"ann_1_10_mine.ipynb": b"?", "ann_1_11_w.zip": BROKEN, "bob_2_12_toy.ipynb": b"bob"}
    taken, collected = taken_from(files, tmp_path)
    assert taken == {"bob": "bob"} and "'ann' cannot be read" in collected.refused[0]


@pytest.mark.parametrize(("first", "second", "counts"), [(BROKEN, b"", "good"), (b"", BROKEN, "")])
def test_the_last_attempt_counts_whatever_an_earlier_one_is(
    tmp_path: Path, first: bytes, second: bytes, counts: str
) -> None:
    good = class_forms.zipped({"toy.ipynb": b"good"})
    names = [f"Lab_{who}_attempt_2026-11-{day}-10-00-00_w.zip" for who, day in (("ann", 19), ("ann", 20), ("bob", 19))]
    taken, collected = taken_from(dict(zip(names, (first or good, second or good, good), strict=True)), tmp_path)
    assert taken.get("ann", "") == counts and taken["bob"] == "good"
    assert bool(collected.refused) == (not counts) and (
        not counts or f"{names[0]!r}, which cannot be read" in collected.line
    )


def test_the_notebook_of_another_lab_is_never_the_only_one(tmp_path: Path) -> None:
    course = toy.make_course(tmp_path / "course")
    (course / "solutions" / "lab1").mkdir()
    (course / "solutions" / "lab1" / "lab1.ipynb").write_text("{}")
    files = {"ann/lab1.ipynb": b"lab 1", "cem/labs/lab1/lab1-1.ipynb": b"lab 1", "bob/mine.ipynb": b"bob"}
    taken, collected = taken_from(files | {"dan_1/toy.ipynb": b"dan"}, tmp_path)
    assert taken == {"bob": "bob", "dan_1": "dan"} and len(collected.refused) == 2
    assert "'ann' handed in only 'lab1.ipynb', which is the notebook of lab1" in collected.refused[0]


def test_of_what_the_course_has_taken_in_only_the_labs_folder_is_read(tmp_path: Path) -> None:
    course = toy.make_course(tmp_path / "course")
    submitted = course / "build" / "submitted"
    for name in ("ann/toy/toy.ipynb", "ann/lab1/lab1.ipynb", "bob/lab1/mine.ipynb", "cem/toy/mine.ipynb"):
        (submitted / name).parent.mkdir(parents=True, exist_ok=True)
        (submitted / name).write_text(name)
    collected = collect(submitted, class_forms.LAB, course)
    taken = {name: path.read_text(encoding="utf-8") for name, path in collected.notebooks.items()}
    assert taken == {"ann": "ann/toy/toy.ipynb", "cem": "cem/toy/mine.ipynb"} and not collected.refused


def test_grading_what_was_taken_in_once_more_forgets_nothing_that_the_platform_said(tmp_path: Path) -> None:
    taken_from(CANVAS, tmp_path)
    record = tmp_path / "course" / "build" / "taken" / "toy.json"
    before = record.read_bytes()
    collect(tmp_path / "course" / "build" / "submitted", class_forms.LAB, tmp_path / "course")
    assert record.read_bytes() == before


def test_what_is_said_of_files_that_do_not_count_is_true(tmp_path: Path) -> None:
    files = CANVAS | {"ann_111_999_scratch.ipynb": b"no", "ann_111_850_toy-1.ipynb": b"no", "readme.txt": b""}
    taken, collected = taken_from(files, tmp_path)
    assert taken == {name: name for name in ("ann", "bob", "cem")}
    assert "'ann_111_999_scratch.ipynb' of 'ann' ('toy.ipynb' counts, because it has the lab's name)" in collected.line
    assert "'ann_111_850_toy-1.ipynb' of 'ann' (a later file counts)" in collected.line
    assert collected.line.endswith("LEFT OUT: 'readme.txt' is not a student's folder, notebook or zip.")


def test_a_record_that_nobody_understands_stops_the_next_class(tmp_path: Path) -> None:
    taken_from(PLAIN, tmp_path)
    (record,) = (tmp_path / "course" / "build" / "taken").iterdir()
    record.write_text('{"ann": ')
    (tmp_path / "in" / "ann" / "toy.ipynb").unlink()
    (tmp_path / "in" / "ann").rmdir()
    with pytest.raises(KitError, match="records who was in the class in the last run, cannot be read"):
        taken_from({}, tmp_path)


KIT = {f"{top}/README.md": b"" for top in ("kit", "labs", "lectures")} | {"labs/toy/toy.ipynb": b"mine"}
KIT |= {"kit/labs/toy/toy.ipynb": b"as handed out", "lectures/a.ipynb": b"a lecture"}
ONE: dict[str, tuple[dict[str, bytes], str]] = {
    # name: (files, who it is with --format plain)
    "a folder in a folder": ({"hw/ann/toy.ipynb": b"mine"}, "ann"),
    "a zip in a folder": ({"hw/ann.zip": class_forms.zipped({"toy.ipynb": b"mine", "a.txt": b""})}, "ann"),
    "a repository": ({"lab-2-submissions/lab-2-ann/labs/toy/toy.ipynb": b"mine"}, "lab-2-ann"),
}


@pytest.mark.parametrize(("files", "owner"), ONE.values(), ids=ONE)
def test_a_class_of_one_is_asked_about_by_its_names_and_the_advice_holds(
    tmp_path: Path, files: dict[str, bytes], owner: str
) -> None:
    outer = next(iter(files)).partition("/")[0]
    source = class_forms.lay_out(files, tmp_path, False)
    try:
        collected = collect(source, class_forms.LAB, tmp_path / "unasked")
    except KitError as stopped:
        assert f"contains only {outer!r}" in stopped.what and f"a class of 1: {owner!r}" in stopped.what
        assert f"If {owner!r} is a student, add --format plain. If {outer!r} is a student" in stopped.do
    else:
        assert list(collected.notebooks) == [owner]  # the name around it is a platform's
    assert list(collect(source, class_forms.LAB, tmp_path / "plain", "plain").notebooks) == [owner]
    (tmp_path / "roster").mkdir()
    (tmp_path / "roster" / "roster.csv").write_text(f"id\n{outer}\n")
    if owner != "lab-2-ann":
        assert list(collect(source, class_forms.LAB, tmp_path / "roster").notebooks) == [outer]


def test_a_single_repository_is_read_where_somebody_names_the_format(tmp_path: Path) -> None:
    source = class_forms.lay_out({"lab-2-ann/labs/toy/toy.ipynb": b"mine"}, tmp_path, False)
    assert list(collect(source, class_forms.LAB, tmp_path / "course", "classroom50").notebooks) == ["lab-2-ann"]
    (tmp_path / "roster").mkdir()
    (tmp_path / "roster" / "roster.csv").write_text("id,github\njd01,ann\n")
    assert list(collect(source, class_forms.LAB, tmp_path / "roster", "classroom50").notebooks) == ["jd01"]


def test_a_packed_kit_is_one_students(tmp_path: Path) -> None:
    taken, collected = taken_from({f"zoe/{name}": text for name, text in KIT.items()}, tmp_path)
    assert taken == {"zoe": "mine"} and collected.students == 1
    source = class_forms.lay_out({"eve.zip": class_forms.zipped(KIT)}, tmp_path / "course", False)
    assert list(collect(source, class_forms.LAB, tmp_path / "other", "plain").notebooks) == ["eve"]
