"""The page of reason codes: what must have been seen for each, its sentences, and where to read on."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from kit_source import KIT, fits, uses

READ_ON = {
    "Errors in callbacks": "2",
    "Blocked callbacks": "2",
    "Spinning": "2",
    "At the same time": "2",
    "Names on the graph": "3",
    "QoS, lifecycle, silence": "45",
    "Expectations: nodes, ends, quality of service": "35",
    "Expectations: messages and callbacks": "2",
    "Expectations: lifecycle, parameters, actions": "34",
    "Files of answers, parameters and launches": "3",
    "Packages: building them": "7",
    "Packages: what was built": "7",
    "Remap and parameter rules: their form": "3",
    "Remap rules: their effect": "3",
}
"""The lectures that explain what a group of reasons is about."""
LECTURES = {"2": "02_executors", "3": "03_remapping", "4": "04_lifecycle", "5": "05_qos", "7": "07_interfaces"}


def reason_codes() -> str:
    """The page of reason codes: a table of what each must have seen, with its sentences, by where it comes from."""
    from autograder.checks.codes import GROUPS
    from autograder.diagnosis.codes import CODES

    found = uses()
    lines: list[str] = []
    groups = {**by_comment(KIT / "diagnosis" / "codes.py", CODES), **GROUPS}
    for title, codes in groups.items():
        lines += [f"## {title}", ""]
        if title in READ_ON:
            lines += [f"Read on: {_lectures(READ_ON[title])}.", ""]
        for code, seen in codes.items():
            own = [use for use in found if fits(code, use.code)]
            lines += [f"({label(code)})=", f"**`{code}`**", f": {_capital(seen)}.", ""]
            sentences = list(dict.fromkeys(use.because for use in own if len(use.because.replace("…", "")) > 12))
            lines += [f"  - “{_shown(sentence)}”" for sentence in sentences[:4]]
            read_on = sorted({number for use in own for number in re.findall(r"[Ll]ecture (\d)", use.hint)})
            if read_on and read_on != list(READ_ON.get(title, "")):
                lines.append(f"  - Read on: {_lectures(read_on)}")
            lines.append("")
    return "\n".join(lines)


def _lectures(numbers: Iterable[str]) -> str:
    return ", ".join(f"{{doc}}`lecture {number} </{LECTURES[number]}>`" for number in numbers)


def by_comment(path: Path, codes: dict[str, str]) -> dict[str, dict[str, str]]:
    """The codes of a table by the comments that stand above them in its source."""
    groups: dict[str, dict[str, str]] = {}
    title = "Reasons"
    for line in path.read_text(encoding="utf-8").splitlines():
        if comment := re.match(r"\s+# (.*?)\.?$", line):
            title = comment.group(1)
        elif (entry := re.match(r'\s+"([a-z-]+)":', line)) and entry.group(1) in codes:
            groups.setdefault(title, {})[entry.group(1)] = codes[entry.group(1)]
    return groups


def _capital(text: str) -> str:
    """A sentence's beginning, unless its first word is code."""
    return text[:1].upper() + text[1:] if text.split()[0].isalpha() else text


def label(code: str) -> str:
    """The name by which other pages point to a code."""
    return f"code-{code}"


def _shown(sentence: str) -> str:
    """A sentence as Markdown shows it: an odd backtick would swallow the rest, and tags are text."""
    text = " ".join(re.sub(r"…(\s*…)+", "…", sentence).split()).replace("<", "&lt;")
    text = re.sub(r"(`…`|\w)…", r"\1 …", text)
    return text if text.count("`") % 2 == 0 else text.replace("`", "'")
