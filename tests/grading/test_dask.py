"""A class on a Dask cluster: scheduler and workers are processes of their own, one of them is killed meanwhile."""

from __future__ import annotations

import shutil
from pathlib import Path

import psutil
import pytest
import toy
from dask_cluster import cluster, until
from places import ROOT

from autograder.core.errors import KitError
from autograder.core.results import Isolation
from autograder.course.lab import load_lab
from autograder.grading.canaries import Canaries, known_answers
from autograder.grading.class_runner import run_class
from autograder.grading.runner import Settings
from autograder.sandbox.isolation import preflight

SLOW = "%%node talker\nimport time\ntime.sleep(3)\nprint('hello')\n"


def test_a_killed_worker_costs_no_result_and_another_kit_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("distributed")
    course = toy.make_course(tmp_path / "course")
    lab = load_lab(course, toy.LAB)
    cells = lab.clean_notebook({"talker": SLOW, "answers": "%%file answers.yaml\nanswer: 42"})["cells"]
    class_ = {f"s{number}": toy.hand_in(tmp_path / "class", f"s{number}", cells) for number in range(4)}
    isolation = Isolation.FULL if preflight().full else Isolation.NONE
    with cluster(tmp_path) as dask:
        settings = Settings(isolation, executor=f"dask://{dask.address}")
        first = dask.worker("first")
        dask.worker("second")
        family: list[psutil.Process] = []

        def kill_the_first(_: object) -> None:
            if not family:  # it has run one, or is running it
                until(lambda: first.children(recursive=True), "the worker runs nothing")
                family.extend(first.children(recursive=True))
                first.kill()

        begun: list[str] = []
        canaries = Canaries(lab, known_answers(course, lab), settings)
        results = run_class(class_, course, lab, settings, kill_the_first, begun.append, canaries=canaries)
        assert set(begun) == set(class_)  # whose names are shown while they run
        assert (canaries.ran, canaries.flips) == (2, [])  # known answers took the same way
        assert {student: result.points for student, result in results.items()} == dict.fromkeys(class_, 5.0)
        assert psutil.wait_procs(family, timeout=120)[1] == []

        other = tmp_path / "other"
        shutil.copytree(ROOT / "autograder", other / "autograder", ignore=shutil.ignore_patterns("__pycache__"))
        (other / "autograder" / "core" / "version.py").write_text('VERSION = "0.0"\n')
        dask.worker("third", other)
        with pytest.raises(KitError, match=r"1 of 2 workers have no kit, or a different one"):
            run_class(class_, course, lab, Settings(isolation, executor=settings.executor, force=True), lambda _: None)
    monkeypatch.setattr("autograder.grading.executors.dask._SECONDS_TO_ANSWER", 1.0)
    with pytest.raises(KitError, match="No Dask scheduler answers"):
        run_class(class_, course, lab, Settings(isolation, executor="dask://tcp://127.0.0.1:1", force=True), print)
