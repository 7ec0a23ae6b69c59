"""The page of the check API: signatures, docstrings, an example of each call, and the codes that it can fail with."""

from __future__ import annotations

import ast
import dataclasses
import inspect
import itertools
import json
import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any

from reason_codes import ROOT, label

from autograder.reasons import all_kinds

_SECTION = re.compile(r"^(Args|Returns|Raises|Example|Codes):\s*$", re.MULTILINE)


@dataclass
class Documented:
    """A docstring in its parts."""

    text: str
    args: list[tuple[str, str]] = field(default_factory=list)
    others: dict[str, str] = field(default_factory=dict)


def documented(thing: Any) -> Documented:
    """Read a docstring that has Google's sections."""
    text = inspect.getdoc(thing) or ""
    pieces = _SECTION.split(text)
    sections = dict(zip(pieces[1::2], map(textwrap.dedent, pieces[2::2]), strict=True))
    args = _fields(thing) + [
        (entry.group(1), " ".join(entry.group(2).split()))
        for entry in re.finditer(r"^(\w+): (.*(?:\n[ \t]+.*)*)", sections.pop("Args", "").strip(), re.MULTILINE)
    ]
    return Documented(pieces[0].strip(), args, {name: body.strip("\n") for name, body in sections.items()})


def _fields(thing: Any) -> list[tuple[str, str]]:
    """The fields of a data class, with the text that stands below each."""
    if not dataclasses.is_dataclass(thing):
        return []
    body = ast.parse(textwrap.dedent(inspect.getsource(thing))).body[0].body
    return [
        (field.target.id, " ".join(text.value.value.split()))
        for field, text in itertools.pairwise(body)
        if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant)
    ]


def signature_of(name: str, thing: Any) -> str:
    """A call as it is written, without types; what has to be named is shown with its value."""
    parts: list[str] = []
    starred = False
    for parameter in inspect.signature(thing).parameters.values():
        if parameter.name == "self":
            continue
        if parameter.kind is inspect.Parameter.KEYWORD_ONLY and not starred:
            parts, starred = [*parts, "*"], True
        if parameter.kind is inspect.Parameter.VAR_POSITIONAL:
            parts, starred = [*parts, f"*{parameter.name}"], True
            continue
        if parameter.kind is inspect.Parameter.VAR_KEYWORD:
            parts.append(f"**{parameter.name}")
            continue
        default = "" if parameter.default is parameter.empty else f"={_value(parameter.default)}"
        parts.append(parameter.name + default)
    line = f"{name}({', '.join(parts)})"
    if len(line) <= 88:
        return line
    lines = textwrap.wrap(", ".join(parts) + ",", 84, break_long_words=False, break_on_hyphens=False)
    return f"{name}(\n" + "\n".join(f"    {one}" for one in lines) + "\n)"


def _value(default: Any) -> str:
    text = f"{default:g}" if isinstance(default, float) else repr(default)
    return text if "<" not in text else "..."


@cache
def examples() -> dict[str, str]:
    """For each name that a check calls, the shortest statement of a released lab that does."""
    found: dict[str, str] = {}
    for path in sorted((ROOT / "labs").glob("*/*.ipynb")):
        for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
            source = "".join(cell["source"])
            if cell["cell_type"] != "code" or source.startswith("%"):
                continue
            for name, statement in _calls(source):
                if len(statement) < len(found.get(name, "x" * 400)):
                    found[name] = statement
    return found


def _calls(source: str) -> Iterator[tuple[str, str]]:
    try:
        tree = ast.parse(source)
    except SyntaxError:
        return
    for node in ast.walk(tree):
        statements = [child for child in ast.iter_child_nodes(node) if isinstance(child, (ast.Expr, ast.Assign))]
        heads = {item.context_expr: item for item in node.items} if isinstance(node, ast.With) else {}
        for part in [*statements, *heads]:
            text = textwrap.dedent(ast.get_source_segment(source, part) or "")
            if part in heads:
                variable = heads[part].optional_vars
                text = f"with {text}" + (f" as {ast.unparse(variable)}" if variable else "") + ":"
            for call in ast.walk(part):
                plain = isinstance(call, ast.Call) and not any(keyword.arg is None for keyword in call.keywords)
                if plain and (call.args or call.keywords):
                    name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
                    yield name, _undented(text)


def _undented(text: str) -> str:
    """A statement whose first line has lost its indentation, and the others not."""
    first, newline, rest = text.partition("\n")
    indent = "    " if rest.strip()[:1] not in ("", ")") else ""
    return first + newline + textwrap.indent(textwrap.dedent(rest), indent)


def _entry(name: str, thing: Any, of: str = "", call: bool = True) -> list[str]:
    said = documented(thing)
    heading = f"{of}.{name}" if of else name
    lines = [f"### {heading}", "", "```python", signature_of(heading, thing) if call else heading, "```", ""]
    lines += [said.text, ""]
    lines += [f"- `{argument}`: {meaning}" for argument, meaning in said.args] + [""]
    for title in ("Returns", "Raises"):
        if title in said.others:
            lines += [f"{title}: {' '.join(said.others[title].split())}", ""]
    example = said.others.get("Example", "")
    example = "\n".join(re.findall(r"`([^`]+)`", example)) or example or examples().get(name, "")
    if example and heading != "table.score":  # the labs' examples are those of `ros.score`
        lines += ["Example:", "", "```python", example.strip("\n"), "```", ""]
    if "Codes" in said.others:
        lines += [f"Can fail with {re.sub('`([a-z-]+)`', _linked, ' '.join(said.others['Codes'].split()))}", ""]
    return lines


def _member(noun: type, name: str, called: str) -> list[str]:
    return _entry(name, _function(noun, name), of=called, call=callable(getattr(noun, name)))


def _linked(word: re.Match[str]) -> str:
    """A code in a docstring as a link to what it stands for; another word as it is."""
    return f"[{word[0]}](#{label(word[1])})" if word[1] in all_kinds() else word[0]


def check_api() -> str:
    """The page of the check API: what `autograder.checks` offers, then what `ros` does, group by group."""
    from autograder import checks
    from autograder.checks.answers import Answers, seal
    from autograder.checks.building import Package
    from autograder.checks.nouns import NOUNS

    lines = ["## What a check cell imports", ""]
    for name in checks.__all__:
        thing = getattr(checks, name)
        if inspect.ismodule(thing):
            lines += [f"### {name}", "", inspect.getdoc(thing) or "", ""]
            functions = [f for _, f in inspect.getmembers(thing, inspect.isfunction) if f.__module__ == thing.__name__]
            for function in functions:
                lines += [f"- `{signature_of(f'{name}.{function.__name__}', function)}`: {inspect.getdoc(function)}"]
            lines.append("")
        elif callable(thing):
            lines += _entry(name, thing)
    for called, noun in NOUNS.items():
        lines += [f"## {called}", "", inspect.getdoc(noun) or "", ""]
        for name, _ in offered(noun):
            lines += _member(noun, name, called)
    lines += ["## A table of answers", "", "`answers` gives a table, which a check looks at in a block of its own.", ""]
    for name, _ in offered(Answers):
        lines += _member(Answers, name, "table")
    lines += ["## A package", "", "`build` gives a package, which a check looks at in a block of its own.", ""]
    for name, _ in offered(Package):
        lines += _member(Package, name, "package")
    lines += [*_entry("seal", seal, of="forms"), "## What these calls give", ""]
    for thing in _given_back():
        lines += [f"### {thing.__name__}", "", documented(thing).text, ""]
        lines += [f"- `{field}`: {meaning}" for field, meaning in _fields(thing)]
        for name, _ in offered(thing):
            call = signature_of(name, _function(thing, name)) if callable(getattr(thing, name)) else name
            lines.append(f"- `{' '.join(call.split())}`: {documented(_function(thing, name)).text.splitlines()[0]}")
        lines.append("")
    return "\n".join(lines)


def _given_back() -> list[type]:
    """The kit's own classes, other than nouns, that the methods of the nouns return, in order."""
    from autograder.checks.nouns import NOUNS

    found: list[type] = []
    for noun in NOUNS.values():
        for name, _ in offered(noun):
            method = _function(noun, name)
            words = re.findall(r"\w+", str(inspect.signature(method).return_annotation))
            things = [method.__globals__.get(word) for word in words]
            found += [it for it in things if inspect.isclass(it) and it.__module__.startswith("autograder.")]
    others = [thing for thing in dict.fromkeys(found) if thing not in NOUNS.values()]
    return [thing for thing in others if offered(thing) or _fields(thing)]


def offered(noun: type) -> list[tuple[str, type]]:
    """The public methods and properties of a noun, each with the class that defines it first."""
    found: dict[str, type] = {}
    for owner in noun.__mro__:
        if not owner.__module__.startswith("autograder."):
            continue  # what Python or pydantic give is theirs to explain
        for name, thing in vars(owner).items():
            is_mine = inspect.isfunction(thing) or isinstance(thing, (property, cached_property))
            if is_mine and not name.startswith("_"):
                found.setdefault(name, owner)
    return list(found.items())


def _function(noun: type, name: str) -> Any:
    """The function behind a method or property of a noun."""
    thing = inspect.getattr_static(noun, name)
    if isinstance(thing, property):
        return thing.fget
    return inspect.unwrap(thing.func if isinstance(thing, cached_property) else thing)
