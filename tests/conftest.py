"""What belongs to the run as a whole."""

from __future__ import annotations

import importlib
import os
import re
import shutil
import signal
import tempfile
from collections.abc import Iterator
from typing import Any

import kill_matrix
import pytest
from crowded_cpu import crowded_cpu  # noqa: F401  a fixture
from graded_cell import grade  # noqa: F401  a fixture
from hypothesis import HealthCheck, settings
from started_processes import started  # noqa: F401  a fixture

from autograder.sandbox.environment import profile_environment

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)

# Fast DDS reads its profile once in a process, for the first participant: that is the kit's in every process of tests.
os.environ.update(profile_environment())

# What this run was asked for, as in `make test ARGS=-v`, is nothing that the commands under test are asked for.
for name in ("ARGS", "LAB", "NB", "MAKEFLAGS", "MFLAGS", "MAKEOVERRIDES"):
    os.environ.pop(name, None)

# Courses of tests are nobody's, and stand in nobody's list.
os.environ["XDG_CONFIG_HOME"] = NOBODYS = tempfile.mkdtemp(prefix="autograder-tests-")
# What an earlier version of the kit has built says nothing about this one.
os.environ["XDG_CACHE_HOME"] = NOBODYS

BROWSER_SECONDS = 180
"""Far beyond what a step of a browser takes on a busy machine."""

LONGEST = (
    "test_lectures",
    "test_building",
    "test_lecture_claims",
    "test_checks",
    "test_attacks",
    "test_setup",
    "test_cli",
    "test_own_course",
    "test_browser",
    "test_student_kit",
    "test_nbgrader_doors",
    "test_nbgrader",
    "test_ros2",
    "test_diagnosis",
    "test_notebook",
    "test_graded_attacks",
    "test_graph",
    "test_worker_limits",
)
"""Files that take long from their first test to their last, the longest first."""
LABS = (
    "lab8_bringup",
    "lab3_remapping",
    "lab1_nodes",
    "lab2_executors",
    "lab4_lifecycle",
    "lab5_qos",
    "lab6_actions",
    "lab7_interfaces",
    "lab9_delivery",
)
"""Labs whose sample classes are graded, the longest first."""
_OF_A_LAB = re.compile(r"/test_classes\.py::.*\[(lab\w+)")

# How fast an example is tells of the machine, and which examples are tried must not be a matter of luck: a property has
# the same ones each time, but in `make test-all`.
STEADY = {"deadline": None, "database": None, "suppress_health_check": [HealthCheck.too_slow]}
settings.register_profile("steady", derandomize=True, **STEADY)
settings.register_profile("complete", derandomize=False, **STEADY)
settings.load_profile("steady")

# A shell starts what it puts into the background deaf to Ctrl-C, and so would be every program that a test interrupts.
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_unconfigure() -> None:
    """Leave nothing behind."""
    shutil.rmtree(NOBODYS, ignore_errors=True)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add what `make test-all` asks for."""
    parser.addoption("--complete", action="store_true", help="every check on every sample student, and all long tests")


def pytest_configure(config: pytest.Config) -> None:
    """Declare the mark of what only `make test-all` runs, before any test is read."""
    settings.load_profile("complete" if config.getoption("complete") else "steady")
    config.addinivalue_line(
        "markers", "complete: runs in `make test-all` only; `make test` has a cheaper one of its kind"
    )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Begin with what takes longest, so that no worker is left alone with it in the end."""
    if not config.getoption("complete"):
        left_out = [item for item in items if item.get_closest_marker("complete")]
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if item not in left_out]
    items.sort(key=_turn)


def _turn(item: pytest.Item) -> float:
    """When a test's turn comes: a lab and a file in turn, so that about half of the workers grade classes at a time."""
    lab = _OF_A_LAB.search(item.nodeid)
    if lab is not None:
        return (*LABS, lab[1]).index(lab[1]) - 0.5
    return (*LONGEST, item.path.stem).index(item.path.stem)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Give a worker a whole file at a time, and of the sample classes, which take longest of all, one lab.

    The public way, `--dist loadgroup`, adds the group to each test's name, which then cannot be given to pytest again.
    """
    if config.getoption("dist") != "loadfile":
        return None
    scheduler = importlib.import_module("xdist.scheduler")

    if not hasattr(scheduler.LoadFileScheduling, "_split_scope"):
        raise pytest.UsageError(
            "This pytest-xdist does not ask `_split_scope` to which group a test belongs. Install the version of"
            " requirements-dev.lock, or give FilesAndLabs in tests/conftest.py the method that it asks now."
        )

    class FilesAndLabs(scheduler.LoadFileScheduling):  # type: ignore[name-defined, misc]
        def _split_scope(self, nodeid: str) -> str:
            lab = _OF_A_LAB.search(nodeid)
            return str(super()._split_scope(nodeid)) + (f" {lab[1]}" if lab is not None else "")

    return FilesAndLabs(config, log)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print which mistake is caught by which check, where the sample classes were graded."""
    reports = terminalreporter.getreports("passed") + terminalreporter.getreports("failed")
    if any("/test_classes.py::" in report.nodeid for report in reports):
        terminalreporter.write_line(kill_matrix.page())


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Start a headless chromium that opens no connection of its own."""
    if CHROMIUM is None:
        if os.environ.get("CI"):
            pytest.fail("CI needs chromium (Debian: apt-get install chromium)")
        pytest.skip("no chromium on this machine (Debian: apt-get install chromium)")
    sync_api = pytest.importorskip("playwright.sync_api")
    with sync_api.sync_playwright() as playwright:
        arguments = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=arguments, timeout=1000 * BROWSER_SECONDS)
        yield started
        started.close()
