"""`make kilted` runs a copy of the kit in which nothing of Jazzy is left; what it finds is no matter of the tests."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import kilted


def test_the_copy_names_only_packages_and_words_of_kilted(tmp_path: Path) -> None:
    kilted.copy_kit(tmp_path / "kit")
    project = (tmp_path / "kit" / "pyproject.toml").read_text(encoding="utf-8")
    assert "ros-jazzy-" not in project and '"ros-kilted-rclpy[fastrtps]"' in project
    sources = [path for path in (tmp_path / "kit" / "autograder").rglob("*") if path.suffix in (".py", ".xml")]
    assert len(sources) > 100
    assert [path for path in sources if any(word in path.read_text(encoding="utf-8") for word in kilted.WORDS)] == []


def test_what_holds_at_the_second_try_is_told_and_is_no_difference() -> None:
    answers = iter([{"a": "does not hold", "b": "does not hold"}, {"b": "does not hold"}, {"b": "does not hold"}])
    found = kilted.differences(lambda name: next(answers), "page")
    assert found == {"a": "held in one of several runs", "b": "does not hold (in 3 of 3 runs)"}
    assert kilted.table([("`page`", "b|c", found["b"])]).splitlines()[-1] == (
        "| `page` | b/c | does not hold (in 3 of 3 runs) |"
    )


def test_the_copy_looks_for_its_own_libraries_and_not_for_those_of_the_course() -> None:
    said = "import os; print(os.environ.get('LD_LIBRARY_PATH', ''))"
    course = subprocess.run([sys.executable, "-c", said], capture_output=True, text=True, check=True).stdout
    assert sys.prefix in course  # as for every program that is started in the course's environment
    alone = [sys.executable, "-S", "-c", said]  # without the packages nothing sets it
    assert sys.prefix not in subprocess.run(alone, env=kilted.environment(), capture_output=True, text=True).stdout
