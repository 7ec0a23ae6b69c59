"""The zip for Gradescope: what lies where its documentation wants it, and a submission that is checked as it does."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import toy

from autograder.authoring.gradescope import write_gradescope
from autograder.course.lab import load_lab


def hand_in(here: Path, name: str, text: str) -> dict[str, object]:
    """Hand in one file, run the autograder, and return what it says."""
    for folder in ("submission", "results"):
        (here / folder).mkdir(exist_ok=True)
        for file in (here / folder).iterdir():
            file.unlink()
    (here / "submission" / name).write_text(text, encoding="utf-8")
    done = subprocess.run(
        [str(here / "source" / "run_autograder")],
        cwd=here, env={**os.environ, "AUTOGRADER_FOLDER": str(here)}, capture_output=True, text=True, timeout=300,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    said: dict[str, object] = json.loads((here / "results" / "results.json").read_text(encoding="utf-8"))
    return said


def test_what_is_uploaded_checks_a_submission(tmp_path: Path) -> None:
    root = toy.make_course(tmp_path / "course")
    made = write_gradescope(root, toy.LAB, tmp_path / "toy.zip")
    here = tmp_path / "autograder"
    with zipfile.ZipFile(made) as archive:
        runs = {info.filename: bool(info.external_attr >> 16 & 0o111) for info in archive.infolist()}
        archive.extractall(here / "source")
    assert runs["setup.sh"] and runs["run_autograder"] and not any("__pycache__" in name for name in runs)
    # In place of what `setup.sh` does: the environment that these tests run in.
    (here / "source" / "run_autograder").chmod(0o755)
    (here / "source" / "kit" / ".venv").symlink_to(sys.prefix)
    sources = {"talker": "%%node talker\nprint('hello')", "answers": "%%file answers.yaml\nanswer: 41", "why": "So."}
    said = hand_in(
        here, "renamed by the browser (1).ipynb", json.dumps(load_lab(root, toy.LAB).clean_notebook(sources))
    )
    assert said["score"] == 3 and [test["score"] for test in said["tests"]] == [3, 0]  # type: ignore[attr-defined]
    assert "secret" not in json.dumps(said)
    said = hand_in(here, "essay.txt", "I forgot the notebook.")
    assert said["score"] == 0 and "hand in one notebook, toy.ipynb" in str(said["output"])
