"""Every sentence of a task is held by a check, and every check by a sample student who breaks just that sentence."""

from __future__ import annotations

from dataclasses import replace

import pytest
import requirements
from places import ROOT

from autograder.authoring.requirements import tasks
from autograder.course.cells import grade_id_of
from autograder.course.lab import load_lab

LABS = requirements.labs()


@pytest.mark.parametrize("name", LABS)
def test_every_sentence_of_a_task_is_a_requirement_or_said_to_be_none(name: str) -> None:
    assert requirements.uncovered(load_lab(ROOT, name)) == []


@pytest.mark.parametrize("name", LABS)
def test_every_requirement_is_in_the_text_held_by_a_check_and_broken_by_a_student(name: str) -> None:
    assert requirements.defects(load_lab(ROOT, name)) == []


@pytest.mark.parametrize("name", LABS)
def test_every_check_holds_a_requirement(name: str) -> None:
    assert requirements.unheld(load_lab(ROOT, name)) == []


@pytest.mark.parametrize("name", LABS)
def test_every_bound_and_every_repetition_says_how_a_check_tries_it(name: str) -> None:
    assert requirements.untried(load_lab(ROOT, name)) == []


@pytest.mark.parametrize("name", LABS)
def test_every_point_that_a_sample_student_loses_has_a_sentence_that_is_broken(name: str) -> None:
    assert requirements.unexplained(load_lab(ROOT, name)) == []


def test_the_table_of_what_is_broken_and_what_is_lost_is_up_to_date() -> None:
    assert requirements.LOST_PAGE.read_text(encoding="utf-8") == requirements.lost_page(), (
        "run `python tests/tools/requirements.py`"
    )


def test_a_task_may_stand_above_a_check_of_a_program_that_grows() -> None:
    lab = load_lab(ROOT, "lab4_lifecycle")
    check = next(cell for cell in lab.released if grade_id_of(cell) == lab.checks[-1].grade_id)
    text = {"cell_type": "markdown", "metadata": {}, "source": "**Change** it, so that it ends."}
    cells = [each for cell in lab.released for each in ([text, cell] if cell is check else [cell])]
    assert "Change it, so that it ends." in tasks(replace(lab, released=tuple(cells)))


def test_the_table_of_requirements_is_up_to_date() -> None:
    assert requirements.PAGE.read_text(encoding="utf-8") == requirements.page(), (
        "run `python tests/tools/requirements.py`"
    )
