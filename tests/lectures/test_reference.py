"""The pages for instructors and authors say what the code does: every reason code, every door, every expectation."""

from __future__ import annotations

import json
import re
import sys
from collections import Counter
from pathlib import Path

import pytest
import yaml
from docutils import nodes
from places import ROOT

sys.path.append(str(ROOT / "lectures" / "_ext"))

import check_api
import reason_codes
import reference

from autograder.checks.nouns import NOUNS
from autograder.course.settings import Section, read_book
from autograder.reasons import KINDS, Group, Kind, all_kinds, kind_of_lab

BOOK = read_book(ROOT)
PAGES = sorted((ROOT / "lectures" / "instructors").glob("*.md"))


def test_a_new_reason_is_declared_in_one_place() -> None:
    try:
        kind = Kind("too-green", "the light was too green", Group.ENDS, "timeline")
        reason = kind("It is green.", "Paint it.")
        assert (reason.code, reason.because, reason.hint, reason.kind.picture) == (
            "too-green", "It is green.", "Paint it.", "timeline",
        )  # fmt: skip
        page = reason_codes.reason_codes()
        assert "**`too-green`**\n: The light was too green.\n\n  - A picture shows" in page
        with pytest.raises(ValueError, match="two kinds of reasons with the code 'too-green'"):
            Kind("too-green", "it was greener", Group.ENDS)
    finally:
        KINDS.pop("too-green", None)


def test_a_code_of_a_lab_is_of_the_kits_kind_where_there_is_one_and_else_of_its_own() -> None:
    assert kind_of_lab("topic-name") is KINDS["topic-name"]
    assert kind_of_lab("lost-update").group is None and "lost-update" not in KINDS


def test_every_kind_has_a_form_of_its_code_and_says_what_was_seen() -> None:
    kinds = all_kinds()
    assert len(kinds) > 200
    assert [code for code in kinds if not re.fullmatch(r"[a-z]+(-[a-z]+)*", code)] == []
    assert [kind.code for kind in kinds.values() if not kind.seen or kind.seen.endswith(".")] == []


def test_every_kind_is_given_somewhere() -> None:
    sources = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "autograder").rglob("*.py"))
    uses = Counter(re.findall(r"\b[A-Z][A-Z_]+\b", sources))
    assert [code for code in all_kinds() if uses[code.upper().replace("-", "_")] < 2] == []


def test_no_text_of_the_kit_names_a_lecture() -> None:
    texts = {path: path.read_bytes() for path in (ROOT / "autograder").rglob("*") if path.suffix not in (".pyc", "")}
    assert [path for path, text in texts.items() if re.search(rb"[Ll]ecture \d", text)] == []


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
    modules = {path.stem for path in (ROOT / "autograder").glob("*.py")} - {"__init__"}
    assert folders | modules == set(re.findall(r"^\| `(\w+)` \| \S", reference.layers(), re.MULTILINE))


def test_everything_that_ros_offers_is_documented() -> None:
    page = check_api.check_api()
    offered = [f"{noun}.{name}" for noun, class_ in NOUNS.items() for name, _ in check_api.offered(class_)]
    assert {"node.expect", "topic.expect_messages", "ros.part", "ros.score", "ros.graph"} <= set(offered)
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


def sections_of(lecture: str) -> list[str]:
    text = (ROOT / "lectures" / f"{BOOK.pages[lecture]}.md").read_text(encoding="utf-8")
    return re.findall(r"^##+ (.*)$", text, re.MULTILINE)


def sections_named_in(text: str) -> list[tuple[str, str]]:
    """Each section of a lecture that a text refers to, in any of the forms in which hints do it."""
    titles = r"'([^'\n]+)'(?: and '([^'\n]+)')?"
    found = re.findall(rf"\b([Ll]ecture \d), (?:sections? )?{titles}", text)
    return [(lecture.capitalize(), title) for lecture, *named in found for title in named if title]


def test_hints_of_the_labs_lead_to_sections_that_the_lectures_have() -> None:
    notebooks = [json.loads(path.read_text(encoding="utf-8")) for path in (ROOT / "solutions").glob("*/*.ipynb")]
    texts = ["".join(cell["source"]) for notebook in notebooks for cell in notebook["cells"]]
    # A hint may be written as two strings, one below the other.
    named = {found for text in texts for found in sections_named_in(re.sub(r'"\s*\n\s*f?"', "", text))}
    assert len(named) > 40
    assert [(lecture, title) for lecture, title in sorted(named) if title not in sections_of(lecture)] == []


def test_links_to_sections_have_the_addresses_that_the_book_has() -> None:
    """A hint's link is made from the title by the kit, and a heading's address by Sphinx."""
    for lecture in BOOK.pages:
        for title in sections_of(lecture):
            place = Section(lecture, title, BOOK.pages[lecture]).place
            assert place == f"{BOOK.pages[lecture]}.html#{nodes.make_id(title)}"


@pytest.mark.parametrize("code", BOOK.sections)
def test_a_reason_leads_to_a_section_that_its_lecture_has(code: str) -> None:
    section = BOOK.sections[code]
    assert section.title in sections_of(section.lecture)
    labs = "".join(path.read_text(encoding="utf-8") for path in ROOT.glob("solutions/*/*.ipynb"))
    assert code in all_kinds() or code in re.findall(r'code=\\?"([a-z-]+)', labs)
