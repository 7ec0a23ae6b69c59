"""`autograder explain`: all that is known of a check, with the messages that it receives as a bag that can be read."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import sample_class
from rosbags.highlevel import AnyReader

from autograder.core.results import CheckResult, Isolation, NodeLog, Outcome, Picture, Status, SubmissionResult
from autograder.course.lab import load_lab
from autograder.course.paths import CoursePaths
from autograder.grading.store import ResultStore
from autograder.submission.reader import read_submission

LAB, CHECK = "lab3_remapping", "check_names"


def test_a_check_is_explained_with_pictures_and_with_its_messages_as_a_bag(tmp_path: Path) -> None:
    root = tmp_path / "course"
    root.mkdir()
    (root / "solutions").symlink_to(sample_class.ROOT / "solutions")
    lab = load_lab(root, LAB)
    notebook = CoursePaths(root).submitted_notebook("solution", LAB)
    sample_class.build_student(lab, "solution", tmp_path)
    notebook.parent.mkdir(parents=True)
    notebook.write_bytes((tmp_path / "solution" / f"{LAB}.ipynb").read_bytes())
    cell = next(cell for cell in lab.checks if cell.grade_id == CHECK)
    outcome = Outcome(
        status=Status.PASSED, title="A hidden thing", observed="what was seen", hidden=True,
        picture=Picture(svg="<svg/>", alt="nothing"),
    )  # fmt: skip
    check = CheckResult(
        grade_id=CHECK, title=cell.title, max_points=2, points=2, outcomes=[outcome], flags=["Look here."],
        logs=[NodeLog(program="camera", text="what it printed")],
    )  # fmt: skip
    digest = read_submission(notebook, lab).digest
    result = SubmissionResult(
        student="solution", lab=LAB, digest=digest, isolation=Isolation.NONE, seed=7, checks=[check]
    )
    ResultStore(root).save(result)
    command = "import sys; sys.argv[0] = 'autograder'; from autograder.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", command, "explain", "solution", CHECK],
        cwd=root, env=os.environ | {"PYTHONPATH": str(sample_class.ROOT)}, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    for said in ("A hidden thing", "what was seen", "Look here.", "what it printed", "/camera/image_color"):
        assert said in done.stdout
    assert "has changed since" not in done.stdout and "gives" not in done.stdout
    folder = CoursePaths(root).explained / LAB / "solution"
    assert (folder / f"{CHECK}_1.svg").read_text() == "<svg/>"
    assert str(folder / CHECK / f"{CHECK}.mcap") in done.stdout
    with AnyReader([folder / CHECK]) as reader:
        (images,) = [one for one in reader.connections if one.msgtype == "sensor_msgs/msg/Image"]
        taken = [reader.deserialize(raw, one.msgtype) for one, _, raw in reader.messages([images])]
    assert len(taken) == images.msgcount > 0 and taken[0].header.frame_id.startswith("frame_")
