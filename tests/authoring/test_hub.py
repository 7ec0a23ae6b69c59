"""The folder from which a JupyterHub serves a course."""

from __future__ import annotations

import json
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
import toy

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
