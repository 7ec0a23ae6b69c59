"""Every file to its owner: classes of every form, in which students chose unlucky and hostile names."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import class_forms
import pytest

from autograder.core.errors import KitError
from autograder.intake.collect import collect


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
