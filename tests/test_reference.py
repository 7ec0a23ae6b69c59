"""The pages for instructors and authors say what the code does: every reason code, every door, every expectation."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT / "lectures" / "_ext"))

import check_api  # noqa: E402  (these make pages of the book)
import kit_source  # noqa: E402
import reason_codes  # noqa: E402
import reference  # noqa: E402

from autograder.checks.codes import GROUPS  # noqa: E402
from autograder.checks.launch import Launch  # noqa: E402
from autograder.diagnosis.codes import CODES  # noqa: E402
from autograder.report.hints import LECTURES, SECTIONS  # noqa: E402

LISTED = [*CODES, *(code for group in GROUPS.values() for code in group)]
PAGES = sorted((ROOT / "lectures" / "instructors").glob("*.md"))


def test_every_code_that_the_kit_gives_is_listed() -> None:
    used = kit_source.codes_used()
    assert len(used) > 100
    assert sorted(code for code in used if not any(kit_source.fits(one, code) for one in LISTED)) == []


def test_no_code_is_listed_twice_or_without_use() -> None:
    assert len(LISTED) == len(set(LISTED))
    filled_in = {code for code in LISTED if code.endswith(("-limit", "-exception"))}  # named by what happened
    used = kit_source.codes_used()
    assert [code for code in LISTED if code not in filled_in and not any(kit_source.fits(code, u) for u in used)] == []


def test_every_code_that_grading_gave_stands_on_the_page_or_in_a_lab() -> None:
    labs = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "solutions").glob("*/*.ipynb"))
    own = set(re.findall(r"[a-z]+(?:-[a-z]+)*", labs))
    given = set()
    for path in (ROOT / "tests" / "classes").glob("*/*/expected.yaml"):
        checks = yaml.safe_load(path.read_text(encoding="utf-8")).get("checks") or {}
        given |= {check["code"] for check in checks.values() if isinstance(check, dict) and "code" in check}
    page = reason_codes.reason_codes()
    assert len(given) > 50
    assert sorted(code for code in given if f"**`{code}`**" not in page and code not in own) == []


def test_every_folder_of_the_package_stands_among_the_layers() -> None:
    folders = {path.parent.name for path in (ROOT / "autograder").glob("*/__init__.py")}
    assert folders == set(re.findall(r"^\| `(\w+)` \| \S", reference.layers(), re.MULTILINE))


def test_groups_of_codes_point_to_lectures_that_are_there() -> None:
    assert reason_codes.READ_ON.keys() <= {*re.findall(r"^## (.*)$", reason_codes.reason_codes(), re.MULTILINE)}
    assert all((ROOT / "lectures" / f"{name}.md").is_file() for name in reason_codes.LECTURES.values())


def test_everything_that_ros_offers_is_documented() -> None:
    page = check_api.check_api()
    offered = [name for name, _ in check_api.offered(Launch)]
    assert {"expect_node", "expect_messages", "part", "score"} <= set(offered)
    assert [name for name in offered if f"\n### {name}\n" not in page] == []


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_files_that_a_page_names_are_there(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    named = set(re.findall(r"`((?:autograder|tests|lectures|solutions|labs)/[\w/.-]+)`", text))
    assert [name for name in sorted(named) if not re.search(r"[A-Z]{2}", name) and not (ROOT / name).exists()] == []


def test_an_example_is_taken_from_what_students_may_see() -> None:
    released = "".join(
        "".join(cell["source"])
        for path in (ROOT / "labs").glob("*/*.ipynb")
        for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]
    )
    for example in check_api.examples().values():
        assert example.splitlines()[0].removesuffix(":") in released


def test_hints_lead_to_sections_that_the_lectures_have() -> None:
    sources = [*(ROOT / "autograder").rglob("*.py"), *(ROOT / "solutions").glob("*/*.ipynb")]
    texts = [path.read_text(encoding="utf-8") for path in sources]
    named = {found for text in texts for found in re.findall(r"Lecture (\d), section '([^']+)'", text)}
    assert len(named) > 3
    for number, section in named:
        lecture = next((ROOT / "lectures").glob(f"0{number}_*.md")).read_text(encoding="utf-8")
        assert re.search(rf"^##+ {re.escape(section)}$", lecture, re.MULTILINE), (number, section)


@pytest.mark.parametrize("where", SECTIONS, ids=lambda where: f"{where[0]}-{where[1]}")
def test_a_reason_leads_to_a_section_that_its_lecture_has(where: tuple[int, str]) -> None:
    number, section = where
    lecture = (ROOT / "lectures" / f"{LECTURES[number]}.md").read_text(encoding="utf-8")
    assert re.search(rf"^##+ {re.escape(section)}$", lecture, re.MULTILINE)
    known = {code for group in GROUPS.values() for code in group} | CODES.keys()
    known |= set(re.findall(r'code=\\?"([a-z-]+)', "".join(p.read_text() for p in ROOT.glob("solutions/*/*.ipynb"))))
    assert set(SECTIONS[where].split()) <= known
