"""Pictures of a world say in words what they show, and mark the point that matters."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree

from autograder.world import Pose, Simulation, read_room
from autograder.world.drawing import Mark, blocks, drawn, still, strip, thinned
from autograder.world.simulation import STEP


def driven(seconds: float) -> Simulation:
    world = Simulation(read_room("room"))
    for _ in range(round(seconds / STEP)):
        world.command("", 0.8, 0.0)
        world.step()
    return world


def test_a_still_shows_the_trail_the_touch_and_the_mark_and_says_so() -> None:
    picture = still(drawn(driven(6.0)), [Mark(3.0, 2.0, "At 5.0 s it stood at (3.0, 2.0).")])
    ElementTree.fromstring(picture.svg)
    assert "drove 3.2 m from (0.9, 2.1) in 6.0 s and is at (4.0, 2.1); it touched something once." in picture.alt
    assert "At 5.0 s it stood at (3.0, 2.0)." in picture.alt and "At 5.0 s it stood" in picture.svg
    assert "parking" in picture.alt and ">parking<" in picture.svg


def test_a_still_without_marks_says_what_its_crosses_are() -> None:
    assert "The car touched something here." in still(drawn(driven(6.0))).svg
    assert "touched" not in still(drawn(driven(2.0))).svg


def test_before_anything_happens_the_car_stands_there() -> None:
    picture = still(drawn(driven(0.0)))
    assert "The car stands at (0.9, 2.1)." in picture.alt
    assert "The car /front stands at" in still(drawn(Simulation(read_room("room"), ["front"]))).alt


def test_a_car_that_was_put_back_has_no_trail_across_the_room() -> None:
    world = driven(3.0)
    world.place("", Pose(5.0, 0.8, 0.0))
    world.step()
    assert "drove 2.2 m" in still(drawn(world)).alt


def test_a_square_shows_where_the_motors_braked_unless_the_car_drove_no_further() -> None:
    world = driven(2.0)
    for _ in range(20):
        world.step()
    assert "braked" not in still(drawn(world)).alt and "■" not in still(drawn(world)).svg
    world.command("", -0.5, 0.0)
    for _ in range(20):
        world.step()
    assert "its motors braked once on the way" in still(drawn(world)).alt and "■" in still(drawn(world)).svg


def test_a_film_strip_shows_moments_from_the_beginning_to_the_end() -> None:
    picture = strip(drawn(driven(5.0)), frames=4)
    assert re.findall(r">(\d\.\d) s<", picture.svg) == ["0.1", "1.7", "3.4", "5.0"]
    assert picture.alt.startswith("4 moments from 0.1 s to 5.0 s.")


def test_a_film_strip_of_the_last_seconds_leaves_out_what_was_before() -> None:
    world = driven(2.0)
    world.place("", Pose(0.9, 0.8, 0.0))
    for _ in range(round(3.0 / STEP)):
        world.command("", 0.4, 0.0)
        world.step()
    picture = strip(drawn(world), frames=4, seconds=3.0)
    assert re.findall(r">(\d\.\d) s<", picture.svg) == ["2.0", "3.0", "4.0", "5.0"]
    assert "The car drove 1.2 m from (2.3, 2.1) in 3.0 s and is at (2.1, 0.8)" in picture.alt


def test_a_picture_of_a_long_run_stays_small() -> None:
    world = driven(0.0)
    for number in range(20 * 60 * 20):
        world.command("", 0.3, 0.6 if number % 400 < 200 else -0.6)
        world.step()
    assert len(still(drawn(world)).svg) < 60_000


def test_cells_are_joined_to_rectangles() -> None:
    import numpy as np

    cells = np.array([[True, True, False], [True, True, True]])
    assert blocks(cells, 0.5) == [(0.0, 0.0, 1.0, 1.0), (1.0, 0.5, 0.5, 0.5)]


def test_a_trail_is_thinned_to_points_apart_and_says_where_the_car_was_put() -> None:
    poses = [Pose(0.01 * number, 0.0, 0.0) for number in range(8)] + [Pose(3.0, 0.0, 0.0)] * 5
    found = [(round(pose.x, 2), jumped) for pose, jumped in thinned(poses, 0.03)]
    assert found == [(0.0, False), (0.03, False), (0.06, False), (3.0, True)]
