"""The table of the course's systems: each is explained, written and graded where the table says."""

from __future__ import annotations

import json
import re
from typing import Any

from places import ROOT

TABLE = ROOT / "lectures" / "appendix" / "systems.md"


def headings(text: str) -> list[str]:
    """The headings of a page."""
    return re.findall(r"^##+ (.+)$", text, re.MULTILINE)


def cells(lab: str) -> list[dict[str, Any]]:
    """The cells of a lab as its author wrote it."""
    notebook = json.loads((ROOT / "solutions" / lab / f"{lab}.ipynb").read_text(encoding="utf-8"))
    return [{**cell, "source": "".join(cell["source"])} for cell in notebook["cells"]]


def sections(lab: str) -> dict[str, list[str]]:
    """For each graded cell of a lab the headings above it. One that only announces a check ends no section."""
    above: list[tuple[int, str]] = []
    found: dict[str, list[str]] = {}
    for cell in cells(lab):
        if cell["cell_type"] == "markdown":
            for signs, title in re.findall(r"^(##+) ((?!Check: ).+)$", cell["source"], re.MULTILINE):
                above = [*(one for one in above if one[0] < len(signs)), (len(signs), title)]
        grading = cell["metadata"].get("nbgrader", {})
        if grading.get("grade"):
            found[grading["grade_id"]] = [title for _, title in above]
    return found


def test_each_system_has_its_places() -> None:
    """Each lecture has the section; each graded cell stands in a section of the lab that is named, and each has one."""
    parts = re.split(r"^## Lab \d: .+\n\n`(\w+)`\n", TABLE.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]
    found, missing = 0, []
    for lab, table in zip(parts[::2], parts[1::2], strict=True):
        graded = sections(lab)
        for row in re.findall(r"^\| (.+) \| (.+) \| (.+) \| (.+) \|$", table, re.MULTILINE)[1:]:
            system, lectures, titles, checks = (cell.split("; ") for cell in row)
            found += 1
            for lecture in lectures:
                link = re.fullmatch(r"\[(.+)\]\(\.\./(\w+)\.md#.+\)", lecture)
                if link is None or link[1] not in headings((ROOT / "lectures" / f"{link[2]}.md").read_text()):
                    missing.append(f"{system}: {lecture}")
            above = {check: graded.get(check.strip("`"), []) for check in checks}
            missing += [f"{system}: {check} in {titles}" for check in checks if not set(titles) & set(above[check])]
            missing += [
                f"{system}: {title}, unchecked" for title in titles if not any(title in a for a in above.values())
            ]
    assert found == 48
    assert missing == []
