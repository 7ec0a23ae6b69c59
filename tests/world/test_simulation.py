"""A car in a room: how it drives, what stops it, what its sensors see, and what the record says of it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from autograder.core.errors import KitError
from autograder.world import Pose, Room, Simulation, read_room
from autograder.world.room import MAPS, room_from
from autograder.world.simulation import NOISE, STEP

HALL = """\
cell: 0.5
places:
  P: parking
map: |
  ############
  #          #
  # >      PP#
  #          #
  ############
"""
"""A car at (1.25, 1.25) that looks at a parking place, whose left edge is at x = 4.5, and at a wall at x = 5.5."""

TWO = HALL.replace("# >      PP#", "# >   <  PP#")


def hall(text: str = HALL) -> Room:
    return room_from(text, "hall.yaml")


def drive(world: Simulation, speed: float, turn: float, seconds: float, name: str = "") -> None:
    """Command a car at each step."""
    for _ in range(round(seconds / STEP)):
        world.command(name, speed, turn)
        world.step()


def go_on(world: Simulation, seconds: float) -> None:
    """Let time go by without a command."""
    for _ in range(round(seconds / STEP)):
        world.step()


def test_a_map_has_its_origin_below_on_the_left_and_a_car_looks_where_its_arrow_points() -> None:
    room = hall()
    assert (room.width, room.height, room.starts) == (6.0, 2.5, (Pose(1.25, 1.25, 0.0),))
    assert (room.place_at(4.6, 1.3), room.place_at(4.4, 1.3), room.place_at(-1.0, 9.0)) == ("parking", "", "")
    assert room.distance_to("parking", 3.5, 1.25) == pytest.approx(1.0)
    headings = [hall(HALL.replace(">", arrow)).starts[0].heading for arrow in "^<v"]
    assert headings == pytest.approx([math.pi / 2, math.pi, -math.pi / 2])


def test_a_car_that_is_drawn_within_a_place_stands_on_it() -> None:
    room = hall(HALL.replace("# >      PP#", "# >     PvP#"))
    assert [room.place_at(x, 1.25) for x in (1.25, 4.75)] == ["", "parking"]
    beside = hall(HALL.replace("# >      PP#", "# >    v PP#"))
    assert beside.place_at(3.75, 1.25) == ""


@pytest.mark.parametrize("name", sorted(path.stem for path in MAPS.glob("*.yaml")))
def test_each_room_of_the_kit_can_be_driven_in(name: str) -> None:
    world = Simulation(read_room(name))
    drive(world, 0.2, 0.0, 1.0)
    assert world.records[""].metres > 0.1 and not world.records[""].touches


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "it has no `map`"),
        ("map: |\n  ###\n  # #", "its map has no car"),
        (HALL.replace("PP", "PQ"), "'Q' in line 3 of the map, letter 11, has no meaning"),
        (HALL.replace("PP", "  "), "the map has no 'P', which `places` names"),
        (HALL.replace("0.5", "wide"), "`cell` is 'wide'"),
        (HALL.replace("0.5", ".nan"), "`cell` is nan"),
        (HALL.replace("P: parking", "'>': parking"), "`places` is not a list of letters with names"),
        (HALL + "walls: 3\n", "it has no `walls`"),
        ("map: [", "cannot be read"),
        ("cell: 1\nmap: |\n" + "  " + "#" * 200 + "\n" + ("  #" + " " * 199 + "\n") * 60, "its map has 12200 cells"),
    ],
)
def test_a_map_that_is_none_is_refused_with_a_sentence(text: str, told: str) -> None:
    with pytest.raises(KitError) as refused:
        hall(text)
    assert told in refused.value.what and refused.value.do


def test_a_room_that_is_not_there_is_refused_with_those_that_are() -> None:
    with pytest.raises(KitError, match="There is no room `garage`") as refused:
        read_room("garage")
    assert "`room`" in refused.value.do


def test_a_car_drives_as_it_is_told_and_not_faster_than_it_can() -> None:
    world = Simulation(hall())
    drive(world, 0.5, 0.0, 1.0)
    assert world.driven[""].speed == pytest.approx(0.5)
    drive(world, 99.0, 0.0, 1.0)
    assert world.driven[""].speed == 1.0
    x, y, heading = world.driven[""].pose
    assert 2.0 < x < 3.0 and (y, heading) == (1.25, 0.0)
    assert world.records[""].metres == pytest.approx(x - 1.25)


def test_a_car_turns_on_the_spot_to_the_left_until_the_watchdog_brakes() -> None:
    world = Simulation(hall())
    drive(world, 0.0, math.pi / 2, 1.0)
    go_on(world, 1.0)
    assert world.driven[""].pose.heading == pytest.approx(1.3 * math.pi / 2, abs=0.1)
    assert world.records[""].metres == 0.0


def test_without_a_command_for_0_3_s_the_motors_brake() -> None:
    world = Simulation(hall())
    drive(world, 0.6, 0.0, 1.0)
    go_on(world, 0.3)
    assert world.driven[""].speed == pytest.approx(0.6) and not world.records[""].trail[-1].braked
    go_on(world, 0.3)
    assert world.driven[""].speed == 0.0 and world.records[""].trail[-1].braked


def test_where_a_heartbeat_is_needed_commands_alone_do_not_move_the_car() -> None:
    world = Simulation(hall(), heartbeat=True)
    drive(world, 0.6, 0.0, 0.5)
    assert world.driven[""].pose == world.room.starts[0]
    world.beat("")
    drive(world, 0.6, 0.0, 0.2)
    assert world.driven[""].speed > 0
    drive(world, 0.6, 0.0, 0.6)
    assert world.driven[""].speed == 0.0
    assert world.missing(world.driven[""]) == "heartbeat"
    go_on(world, 0.6)
    assert world.missing(world.driven[""]) == "command"
    (brake,) = world.records[""].brakes
    assert (
        brake.time == pytest.approx(0.5 + 0.3 + STEP)
        and world.room.starts[0].x < brake.pose.x < world.driven[""].pose.x
    )


@pytest.mark.parametrize("command", [(math.nan, 0.0), (0.5, math.inf), (-math.inf, math.nan)])
def test_a_command_that_is_no_number_does_not_move_the_car(command: tuple[float, float]) -> None:
    world = Simulation(hall())
    drive(world, *command, 1.0)
    assert world.driven[""].pose == world.room.starts[0] and world.records[""].commands == 20


def test_a_wall_stops_the_car_and_is_touched_once_until_it_drives_away() -> None:
    world = Simulation(hall())
    drive(world, 1.0, 0.0, 6.0)
    (touch,) = world.records[""].touches
    assert (touch.what, touch.x) == ("a wall", pytest.approx(5.5, abs=0.06))
    assert world.driven[""].pose.x < 5.3 and 4.0 < touch.time < 5.5
    assert 3.0 < world.records[""].places["parking"] < touch.time
    drive(world, -0.5, 0.0, 1.0)
    drive(world, 1.0, 0.0, 2.0)
    assert len(world.records[""].touches) == 2


def test_a_parked_car_is_an_obstacle_and_two_driven_cars_are_told_apart() -> None:
    world = Simulation(hall(TWO))
    drive(world, 1.0, 0.0, 4.0)
    assert [touch.what for touch in world.records[""].touches] == ["a car"]
    world = Simulation(hall(TWO), ["front", "rear"])
    drive(world, 0.3, 0.0, 1.0, "rear")
    assert world.driven["front"].pose == world.room.starts[0]
    assert world.driven["rear"].pose.x < world.room.starts[1].x
    with pytest.raises(ValueError, match="3 cars are to be driven, and the map has 2"):
        Simulation(hall(TWO), ["one", "two", "three"])


def test_the_lidar_measures_to_walls_and_other_cars() -> None:
    scan = Simulation(hall()).scan("")
    ahead, left, behind = scan[90], scan[135], scan[0]
    assert (ahead, left, behind) == pytest.approx((4.25, 0.75, 0.75), abs=6 * NOISE)
    assert len(scan) == 180 and scan.dtype == np.float32
    assert Simulation(hall(TWO)).scan("")[90] == pytest.approx(3.25 - 0.2 - 1.25, abs=6 * NOISE)
    wide = HALL.replace("          ", " " * 30).replace("      PP", " " * 26 + "PP")
    assert np.isinf(Simulation(hall(wide.replace("#" * 12, "#" * 32))).scan("")[90])


def test_the_camera_sees_the_wall_in_the_middle_and_the_yellow_place_on_the_floor() -> None:
    world = Simulation(hall())
    assert world.place("", Pose(4.0, 1.25, 0.0)) == ""
    picture = world.picture("")
    assert picture.shape == (48, 64, 3)
    sky, middle, floor = picture[0, 32], picture[22, 32], picture[38, 32]
    assert sky[2] > 230 and max(middle) - min(middle) < 10 and floor[0] > 200 > floor[2]


def test_a_car_can_be_placed_and_put_back_but_not_into_a_wall() -> None:
    world = Simulation(hall())
    assert world.place("", Pose(0.3, 1.25, 0.0)).startswith("a wall is at (0.")
    assert world.place("", Pose(math.nan, 0.0, 0.0)) == "x, y and heading are finite numbers"
    assert world.place("", Pose(3.0, 1.25, 7.0)) == ""
    assert world.driven[""].pose == Pose(3.0, 1.25, pytest.approx(7.0 - math.tau))
    world.reset("")
    assert world.driven[""].pose == world.room.starts[0]


def test_the_same_seed_and_commands_give_the_same_world() -> None:
    def run(seed: int) -> tuple[list[object], list[float]]:
        world = Simulation(hall(), seed=seed)
        drive(world, 0.7, 0.4, 3.0)
        return list(world.records[""].trail), list(world.scan(""))

    assert run(3) == run(3)
    assert run(3)[0] == run(4)[0] and run(3)[1] != run(4)[1]


def test_driving_uses_the_battery_and_an_empty_one_does_not_drive() -> None:
    world = Simulation(hall())
    drive(world, 1.0, 0.0, 2.0)
    assert 0.99 < world.driven[""].charge < 1.0
    world.driven[""].charge = 0.0
    drive(world, 1.0, 0.0, 1.0)
    assert world.driven[""].speed == 0.0
