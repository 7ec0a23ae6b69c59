"""Writes the reference pages from the kit's own source, so that they cannot say something else than the code does.

In a page, a line `<!-- generated: NAME -->` is replaced by what the code says of itself:

- `check api`: what a check cell can say, from its signatures and docstrings;
- `reason codes`: every reason code with what it must have seen;
- `layers`: the folders of the package in the order in which they may import each other.
"""

from __future__ import annotations

import ast
import dataclasses
import inspect
import itertools
import json
import re
import textwrap
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

ROOT = Path(__file__).resolve().parent.parent.parent
KIT = ROOT / "autograder"
LECTURES = {"2": "02_executors", "3": "03_remapping", "4": "04_lifecycle", "5": "05_qos"}

_CODE = re.compile(r"(CPU-)?[a-z]+(-[a-z]+)*")
_POSITIONS = {
    "Diagnosis": (0, 1, 2), "CommandLineError": (0, 1, 2), "StudentFileError": (0, 1, 2), "problem": (2, 0, 3),
    "_error": (3, 4, 5),
    "undecided": (1, 3, 4),
}  # fmt: skip
"""Where the sentence, the code and the hint stand in calls that give them by position."""
_RULES = ("rule_effect.py", "rule_grammar.py", "traces.py")
"""Modules that give a reason as a tuple of three."""
GENERAL = 4
"""So many groups of the diagnosis' codes, from the first, are about the program itself: every expectation has them."""
_SECTION = re.compile(r"^(Args|Returns|Raises|Example|Codes):\s*$", re.MULTILINE)


# Reason codes.


@dataclass
class Use:
    """A place in the source that gives a reason."""

    code: str
    """`*` stands for what is filled in when it is given."""
    because: str
    hint: str
    path: Path
    function: str


def uses() -> list[Use]:
    """Every reason that the package gives, in the order of its files."""
    return [use for path in sorted(KIT.rglob("*.py")) for use in _uses_in(path)]


def codes_used() -> set[str]:
    """Every code that the package gives; `*` stands for a word that is filled in."""
    return {use.code for use in uses()}


@cache
def _parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def _uses_in(path: Path) -> Iterator[Use]:
    tree = _parsed(path)
    names = {
        node.targets[0].id: node.value.value
        for node in tree.body
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name)
        if isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
    }
    for function, node in _with_function(tree):
        because, code, hint = _reason(node, path.name in _RULES)
        for word in _words(code, names):
            yield Use(word, _sentence(because), _sentence(hint), path, function)


def _with_function(tree: ast.Module) -> Iterator[tuple[str, ast.AST]]:
    """Every node of a module with the name of the function that it stands in."""
    stack: list[tuple[str, ast.AST]] = [("", tree)]
    while stack:
        function, node = stack.pop()
        yield function, node
        inner = node.name if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)) else function
        stack += [(inner, child) for child in reversed(list(ast.iter_child_nodes(node)))]


def _reason(node: ast.AST, tuples: bool) -> tuple[ast.expr | None, ast.expr | None, ast.expr | None]:
    """The sentence, the code and the hint that a call carries, or a tuple of three, or a parameter's default."""
    if isinstance(node, ast.arguments):
        pairs = zip(reversed([*node.posonlyargs, *node.args]), reversed(node.defaults), strict=False)
        return None, next((value for argument, value in pairs if argument.arg == "code"), None), None
    if isinstance(node, ast.Call):
        keywords = {keyword.arg: keyword.value for keyword in node.keywords}
        called = getattr(node.func, "id", getattr(node.func, "attr", ""))
        at = dict(enumerate(node.args))
        by_position = [at.get(place) for place in _POSITIONS.get(called, ())] or [None, None, None]
        because, code, hint = by_position
        return keywords.get("because", because), keywords.get("code", code), keywords.get("hint", hint)
    if tuples and isinstance(node, ast.Tuple) and len(node.elts) == 3:
        first, code, hint = node.elts
        words = isinstance(first, ast.Constant) and not str(first.value).endswith(".")  # that a traceback is known by
        return None if words else first, code, hint
    return None, None, None


def _words(code: ast.expr | None, names: dict[str, str]) -> list[str]:
    """The codes that an expression can give, as far as its text tells."""
    if code is None:
        return []
    if isinstance(code, ast.Constant):
        return [code.value] if isinstance(code.value, str) and _CODE.fullmatch(code.value) else []
    if isinstance(code, ast.JoinedStr):
        return ["".join(str(part.value) if isinstance(part, ast.Constant) else "*" for part in code.values)]
    if isinstance(code, ast.IfExp):
        return _words(code.body, names) + _words(code.orelse, names)
    if isinstance(code, ast.BoolOp):
        return [word for value in code.values for word in _words(value, names)]
    if isinstance(code, ast.Name):
        return [names[code.id]] if code.id in names else []
    return []


def _sentence(text: ast.expr | None) -> str:
    """The text of a string with an ellipsis where something is filled in; empty where it comes from elsewhere."""
    if isinstance(text, ast.Constant) and isinstance(text.value, str):
        return text.value
    if isinstance(text, ast.JoinedStr):
        return re.sub(r"…(\s*…)+", "…", "".join(_sentence(part) or "…" for part in text.values)).strip()
    if isinstance(text, ast.BinOp) and isinstance(text.op, ast.Add):
        return _sentence(text.left) + (_sentence(text.right) or "…")
    return ""


def fits(code: str, pattern: str) -> bool:
    """Whether a code is one of those that a code with a `*` stands for."""
    return re.fullmatch(re.escape(pattern).replace(r"\*", r"[a-z-]+"), code) is not None


def reason_codes() -> str:
    """The page of reason codes: a table of what each must have seen, with its sentences, by where it comes from."""
    from autograder.checks.codes import GROUPS
    from autograder.diagnosis.codes import CODES

    found = uses()
    lines: list[str] = []
    groups = {**_by_comment(KIT / "diagnosis" / "codes.py", CODES), **GROUPS}
    for title, codes in groups.items():
        lines += [f"## {title}", ""]
        for code, seen in codes.items():
            own = [use for use in found if fits(code, use.code)]
            lines += [f"({_label(code)})=", f"**`{code}`**", f": {seen[:1].upper()}{seen[1:]}.", ""]
            sentences = list(dict.fromkeys(use.because for use in own if len(use.because.replace("…", "")) > 12))
            lines += [f"  - “{_shown(sentence)}”" for sentence in sentences[:4]]
            read_on = sorted({number for use in own for number in re.findall(r"[Ll]ecture (\d)", use.hint)})
            if read_on:
                links = ", ".join(f"{{doc}}`lecture {number} </{LECTURES[number]}>`" for number in read_on)
                lines.append(f"  - Read on: {links}")
            lines.append("")
    return "\n".join(lines)


def _by_comment(path: Path, codes: dict[str, str]) -> dict[str, dict[str, str]]:
    """The codes of a table by the comments that stand above them in its source."""
    groups: dict[str, dict[str, str]] = {}
    title = "Reasons"
    for line in path.read_text(encoding="utf-8").splitlines():
        if comment := re.match(r"\s+# (.*?)\.?$", line):
            title = comment.group(1)
        elif (entry := re.match(r'\s+"([a-z-]+)":', line)) and entry.group(1) in codes:
            groups.setdefault(title, {})[entry.group(1)] = codes[entry.group(1)]
    return groups


def _label(code: str) -> str:
    return f"code-{code}"


def _shown(sentence: str) -> str:
    """A sentence as Markdown shows it: an odd backtick would swallow the rest, and tags are text."""
    text = " ".join(re.sub(r"…(\s*…)+", "…", sentence).split()).replace("<", "&lt;")
    text = re.sub(r"(`…`|\w)…", r"\1 …", text)
    return text if text.count("`") % 2 == 0 else text.replace("`", "'")


# The check API.


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


@cache
def _by_function() -> dict[str, tuple[set[str], set[str]]]:
    """The codes that each function of the checks and of the diagnosis gives itself, and the functions it calls."""
    found: dict[str, tuple[set[str], set[str]]] = {}
    for path in sorted([*(KIT / "checks").rglob("*.py"), *(KIT / "diagnosis").rglob("*.py")]):
        for use in _uses_in(path):
            found.setdefault(use.function, (set(), set()))[0].add(use.code)
        for function, node in _with_function(_parsed(path)):
            if isinstance(node, ast.Call) and (called := _own_function(node.func)):
                found.setdefault(function, (set(), set()))[1].add(called)
    return found


def _own_function(called: ast.expr) -> str:
    """The name of a function of the same module, class or package that is called; empty for others' methods."""
    if isinstance(called, ast.Name):
        return called.id
    if isinstance(called, ast.Attribute) and isinstance(called.value, ast.Name):
        return called.attr if called.value.id in ("self", "diagnosis") else ""
    return ""


def failures(name: str) -> list[str]:
    """The codes that a function can fail with, its helpers included; without those that every expectation has."""
    table = _by_function()
    codes: set[str] = set()
    front, done = [name], set()
    while front:
        function = front.pop()
        # What these say is true of every expectation; the page says it once.
        if function in done or function in ("fail", "settle_programs", "inside_reason", "program_trouble", "start"):
            continue
        done.add(function)
        own, called = table.get(function, (set(), set()))
        codes |= own
        front += called & table.keys()
    return sorted(codes)


def _entry(name: str, thing: Any, with_failures: bool, of: str = "") -> list[str]:
    from autograder.checks.codes import GROUPS
    from autograder.diagnosis.codes import CODES

    said = documented(thing)
    heading = name if of in ("", "ros") else f"{of}.{name}"
    lines = [f"### {heading}", "", "```python", signature_of(f"{of}.{name}" if of else name, thing), "```", ""]
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
    elif with_failures:
        general = list(_by_comment(KIT / "diagnosis" / "codes.py", CODES).values())[:GENERAL]
        known = [code for code in CODES if not any(code in group for group in general)]
        known += [code for group in GROUPS.values() for code in group]
        fitting = [code for code in known if any(fits(code, pattern) for pattern in failures(name))]
        if fitting:
            links = ", ".join(f"[`{code}`](#{_label(code)})" for code in dict.fromkeys(fitting))
            lines += [f"Can fail with {links}.", ""]
    return lines


def _linked(word: re.Match[str]) -> str:
    """A code in a docstring as a link to what it stands for; another word as it is."""
    from autograder.checks.codes import GROUPS
    from autograder.diagnosis.codes import CODES

    listed = word[1] in CODES or any(word[1] in group for group in GROUPS.values())
    return f"[{word[0]}](#{_label(word[1])})" if listed else word[0]


def check_api() -> str:
    """The page of the check API: what `autograder.checks` offers, then what `ros` does, group by group."""
    from autograder import checks
    from autograder.checks.answers import Answers
    from autograder.checks.forms import seal
    from autograder.checks.launch import Launch

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
            lines += _entry(name, thing, with_failures=False)
    owner = None
    for name, group in offered(Launch):
        if group is not owner:
            lines += [f"## {_title(group)}", ""]
            owner = group
        lines += _entry(name, inspect.unwrap(getattr(Launch, name)), with_failures=True, of="ros")
    lines += ["## A table of answers", "", "`answers` gives a table, which a check looks at in a block of its own.", ""]
    for name, _ in offered(Answers):
        lines += _entry(name, getattr(Answers, name), with_failures=False, of="table")
    lines += [*_entry("seal", seal, with_failures=False, of="forms"), "## What these calls give", ""]
    for thing in _given_back(Launch):
        lines += [f"### {thing.__name__}", "", documented(thing).text, ""]
        lines += [f"- `{field}`: {meaning}" for field, meaning in _fields(thing)]
        for name, _ in offered(thing):
            call = signature_of(name, getattr(thing, name))
            lines.append(f"- `{' '.join(call.split())}`: {documented(getattr(thing, name)).text.splitlines()[0]}")
        lines.append("")
    return "\n".join(lines)


def _given_back(launch: type) -> list[type]:
    """The kit's own classes that the methods of a launch return, in order."""
    found: list[type] = []
    for name, _ in offered(launch):
        method = inspect.unwrap(getattr(launch, name))
        words = re.findall(r"\w+", str(inspect.signature(method).return_annotation))
        things = [method.__globals__.get(word) for word in words]
        found += [thing for thing in things if inspect.isclass(thing) and thing.__module__.startswith("autograder.")]
    return [thing for thing in dict.fromkeys(found) if offered(thing) or _fields(thing)]


def offered(launch: type) -> list[tuple[str, type]]:
    """The public methods of a launch, each with the class that defines it first."""
    found: dict[str, type] = {}
    for owner in launch.__mro__:
        for name, thing in vars(owner).items():
            # What a launch does to say what it waits for is put around the methods of other classes.
            mine = inspect.isfunction(thing) and inspect.unwrap(thing).__qualname__.startswith(f"{owner.__name__}.")
            if mine and not name.startswith("_"):
                found.setdefault(name, owner)
    return list(found.items())


def _title(owner: type) -> str:
    text = (inspect.getdoc(owner) or owner.__name__).split("\n")[0]
    return re.split(r"[:.] |[:.]$", text)[0].replace("`", "")


# The layers.


def layers() -> str:
    """The folders of the package from the top down, as import-linter holds them, with what each says it is for."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contract = next(one for one in settings["tool"]["importlinter"]["contracts"] if one["type"] == "layers")
    lines = ["| folder | what it is for |", "|---|---|"]
    for layer in contract["layers"]:
        about = (ast.get_docstring(_parsed(KIT / layer / "__init__.py")) or "").split("\n\n")[0]
        lines.append(f"| `{layer}` | {' '.join(about.split())} |")
    return "\n".join(lines)


# Sphinx.

PARTS: dict[str, Callable[[], str]] = {"check api": check_api, "reason codes": reason_codes, "layers": layers}


def on_read(app: Sphinx, docname: str, source: list[str]) -> None:
    """Put what is generated in the place of the line that asks for it."""
    for name, make in PARTS.items():
        line = f"<!-- generated: {name} -->"
        if line in source[0]:
            source[0] = source[0].replace(line, make())
            for path in KIT.rglob("*.py"):
                app.env.note_dependency(str(path))


def on_doctree(app: Sphinx, doctree: nodes.document) -> None:
    """Leave out what a cell showed only while it ran: how long it has been waiting for what."""
    for block in list(doctree.findall(nodes.literal_block)):
        if not block.astext().strip():
            block.parent.remove(block)


def on_builder(app: Sphinx) -> None:
    """Make no slides of the part for instructors; the book, which is built first, has followed the links to it."""
    if app.builder.name == "revealjs":
        app.config.exclude_patterns.append("instructors")
        app.config.suppress_warnings += ["toc.excluded", "toc.not_readable", "ref.doc"]


def setup(app: Sphinx) -> dict[str, Any]:
    """Register with Sphinx."""
    app.connect("builder-inited", on_builder)
    app.connect("source-read", on_read)
    app.connect("doctree-read", on_doctree)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
