"""The table of the course's systems: each is explained, written and graded where the table says."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
TABLE = ROOT / "lectures" / "appendix" / "systems.md"


def headings(text: str) -> list[str]:
    """The headings of a page or a text cell."""
    return re.findall(r"^##+ (.+)$", text, re.MULTILINE)


def cells(lab: str) -> list[dict[str, Any]]:
    """The cells of a lab as its author wrote it."""
    notebook = json.loads((ROOT / "solutions" / lab / f"{lab}.ipynb").read_text(encoding="utf-8"))
    return [{**cell, "source": "".join(cell["source"])} for cell in notebook["cells"]]


def test_each_system_has_its_places() -> None:
    parts = re.split(r"^## Lab \d: .+\n\n`(\w+)`\n", TABLE.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]
    found, missing = 0, []
    for lab, table in zip(parts[::2], parts[1::2], strict=True):
        titles = [title for cell in cells(lab) if cell["cell_type"] == "markdown" for title in headings(cell["source"])]
        graded = {cell["metadata"].get("nbgrader", {}).get("grade_id"): cell for cell in cells(lab)}
        for row in re.findall(r"^\| (.+) \| (.+) \| (.+) \| (.+) \|$", table, re.MULTILINE)[1:]:
            system, lecture, title, check = row
            found += 1
            link = re.fullmatch(r"\[(.+)\]\(\.\./(\w+)\.md#.+\)", lecture)
            page = ROOT / "lectures" / f"{link[2]}.md" if link else None
            missing += [
                f"{system}: {what}"
                for what, there in (
                    (lecture, page is not None and link is not None and link[1] in headings(page.read_text())),
                    (title, title in titles),
                    (check, graded.get(check.strip("`"), {}).get("metadata", {}).get("nbgrader", {}).get("grade")),
                )
                if not there
            ]
    assert found == 44
    assert missing == []
