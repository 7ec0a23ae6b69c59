"""The folder from which a JupyterHub serves a course, and a real hub through the steps of a term."""

from __future__ import annotations

import json
import os
import pwd
import shutil
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import real_hub
import toy
from conftest import BROWSER_SECONDS
from real_hub import LAB, PASSWORD, Hub, Person, space_of, wait_for

from autograder.authoring.hub import write_hub
from autograder.core.errors import KitError

needs_root = pytest.mark.skipif(os.getuid() != 0, reason="only root may give the folders of a hub to their owners")


@pytest.fixture
def place() -> Iterator[Path]:
    """A folder that every user of the machine may enter, unlike pytest's own."""
    folder = Path(tempfile.mkdtemp(prefix="hub-"))
    folder.chmod(0o755)
    yield folder
    shutil.rmtree(folder, ignore_errors=True)


def course_of(place: Path, owner: str) -> Path:
    from autograder.authoring.release import START_PAGE, release, start_page

    root = toy.make_course(place / "course")
    release(root, toy.LAB)
    (root / "labs" / START_PAGE).write_text(start_page(root / "labs"), encoding="utf-8")
    shutil.chown(root, owner)
    return root


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@needs_root
def test_the_folder_of_a_hub_belongs_to_root_and_its_exchange_to_the_grader(place: Path) -> None:
    root = course_of(place, "nobody")
    hub = place / "ros2"
    write_hub(root, None, hub)
    exchange = hub / "exchange" / "ros2"
    assert mode(hub / "exchange") == 0o1777 and mode(hub / "state") == 0o700
    assert {path.name: mode(path) for path in exchange.iterdir()} == {
        "inbound": 0o2733, "outbound": 0o755, "feedback": 0o711,
    }  # fmt: skip
    assert exchange.owner() == "nobody" and (hub / "ros2-labs" / "kit" / "labs" / "toy" / "toy.ipynb").is_file()
    settings = json.loads((hub / "settings" / "nbgrader_config.json").read_text())
    assert settings["CourseDirectory"]["course_id"] == "ros2" and settings["Exchange"]["root"] == str(hub / "exchange")
    configuration = hub / "jupyterhub_config.py"
    assert f'COURSE = Path("{root}")' in configuration.read_text() and "@" not in configuration.read_text()

    configuration.write_text("# changed by the administrator")
    (hub / "ros2-labs" / ".venv").mkdir()
    told = write_hub(root, None, hub)  # a new version of the labs
    assert configuration.read_text() == "# changed by the administrator" and "kept as it is" in told[-1]
    assert (hub / "ros2-labs" / ".venv").is_dir()


@needs_root
def test_a_course_that_belongs_to_root_is_not_served(place: Path) -> None:
    with pytest.raises(KitError, match="belongs to root") as refused:
        write_hub(course_of(place, "root"), None, place / "ros2")
    assert "chown" in refused.value.do and not (place / "ros2").exists()


@needs_root
def test_a_folder_whose_path_leaves_no_room_for_sockets_is_refused(place: Path) -> None:
    with pytest.raises(KitError, match="too long for the sockets") as refused:
        write_hub(course_of(place, "nobody"), None, place / "a-course-with-a-long-name")
    assert "/srv/ros2" in refused.value.do and not (place / "a-course-with-a-long-name").exists()


ANN, BOB, GRADER = "hub-t-ann", "hub-t-bob", "hub-t-grader"


@pytest.fixture
def hub(place: Path) -> Iterator[Hub]:
    """A running hub with a grader and two students, who have passwords of this machine."""
    made = Hub(place, [ANN, BOB], GRADER)
    try:
        made.make_users()
        made.set_up()
        made.start()
        yield made
    finally:
        made.remove()


def page_of(browser: Any, hub: Hub, user: str) -> Any:
    """Log in with a browser, and wait for JupyterLab."""
    page = browser.new_context().new_page()
    page.set_default_timeout(BROWSER_SECONDS * 1000)
    page.goto(f"{hub.address}/hub/login")
    page.fill("input[name=username]", user)
    page.fill("input[name=password]", PASSWORD)
    page.click("input[type=submit]")
    page.wait_for_url(f"**/user/{user}/lab**")
    page.wait_for_selector(".lm-MenuBar >> text=Nbgrader")
    return page


def click_in_list(page: Any, part: str, button: str, then: str) -> None:
    """Click on the button of the lab in the list of assignments, and wait until it is in another part of the list."""
    if not page.locator("#released_assignments_list").is_visible():  # after a reload, it may be behind another tab
        page.click(".lm-MenuBar >> text=Nbgrader")  # the page of the labs names the menu as well
        page.click(".lm-Menu >> text=Assignment List")
    page.click("#refresh_assignments_list")
    page.locator(f"#{part}_assignments_list .list_item", has_text=LAB).get_by_text(button, exact=True).first.click()
    page.wait_for_selector(f"#{then}_assignments_list .list_item:has-text('{LAB}')")


@pytest.mark.complete  # `make test` has the folder of a hub above, which needs no hub
@pytest.mark.skipif(bool(real_hub.lacking()), reason=f"a real hub needs what this machine lacks: {real_hub.lacking()}")
def test_a_term_on_a_real_hub_in_which_nobody_sees_the_others(hub: Hub, place: Path, browser: Any) -> None:
    solved = course_answers(hub)
    pages = {user: page_of(browser, hub, user) for user in (ANN, BOB)}
    grader, ann, bob = (Person(hub, user) for user in (GRADER, ANN, BOB))
    grader.start()
    real_hub.release_lab(grader)
    assert ann.get("formgrader").status_code == 404
    for person, greeter in ((ann, solved["greeter"]), (bob, solved["greeter"].replace('"Hello"', '"Goodbye"'))):
        click_in_list(pages[person.name], "released", "Fetch", "fetched")
        real_hub.write_answers(person, solved | {"greeter": greeter})
        real_hub.start_robot(person, greeter)
    nobody_sees_the_other(ann, bob)
    nobody_sees_the_other(bob, ann)

    hub.stop()
    hub.start()
    for person, passed in ((ann, "5 of 5"), (bob, "3 of 5")):
        wait_for(lambda person=person: person.get("api/status").ok, "the server is lost with the hub")
        assert "/greeter" in person.run("%ros2 node list"), "the robot has gone on"
        person.run("robot.stop()")
        assert passed in " ".join(person.run(f"!autograder check {LAB}.ipynb").split())
        pages[person.name].reload()
        pages[person.name].wait_for_selector(".lm-MenuBar >> text=Nbgrader")
        click_in_list(pages[person.name], "fetched", "Submit", "submitted")
    real_hub.grade_class(grader)
    for person, points in ((ann, "5 of 5 points"), (bob, "3 of 5 points")):
        click_in_list(pages[person.name], "submitted", "Fetch Feedback", "submitted")
        found = wait_for(
            lambda person=person: list((place / person.name / "labs").glob(f"**/feedback/**/{LAB}.html")), "none"
        )
        assert points in found[0].read_text(encoding="utf-8")


def course_answers(hub: Hub) -> dict[str, str]:
    """The solution of each answer of the lab, by grade_id."""
    from autograder.course.lab import load_lab

    return {name: answer.solution for name, answer in load_lab(hub.course, LAB).answers.items()}


def nobody_sees_the_other(person: Person, other: Person) -> None:
    """A user sees only the own nodes and topics, and reads neither the other's home, nor logs, nor server."""
    nodes, topics = person.run("%ros2 node list"), person.run("%ros2 topic list")
    assert f"/{space_of(person.name)}/greeter" in nodes and space_of(other.name) not in nodes
    assert f"/{space_of(person.name)}/greetings" in topics and space_of(other.name) not in topics
    home, logs = Path(pwd.getpwnam(other.name).pw_dir), Path(f"/tmp/autograder-log-{pwd.getpwnam(other.name).pw_uid}")
    assert logs.is_dir() and mode(logs) == 0o700 and mode(home) == 0o700
    told = person.run(f"!ls {home} {logs}; cat {home}/labs/{LAB}/{LAB}.ipynb")
    assert told.count("Permission denied") == 3, told
    assert person.get("api/contents/", user=other.name).status_code in (403, 404)
