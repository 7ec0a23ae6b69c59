"""The one way in for YAML that a student wrote: plain files as PyYAML reads them, everything else a sentence."""

from __future__ import annotations

import contextlib
import re
from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from autograder.core.student_yaml import DEPTH, FILE_BYTES, VALUES, load, read
from autograder.reasons import Refused


def refused(text: str) -> Refused:
    with pytest.raises(Refused) as caught:
        load(text, "`a.yaml`")
    assert str(caught.value).startswith("`a.yaml`") and str(caught.value).endswith(".")
    assert len(str(caught.value)) < 400
    return caught.value


@pytest.mark.parametrize(
    "text",
    [
        "", "a: 1\nb: [1, 2.5, yes, ~]\n", "a: {b: {c: d}}", "- a\n- b", "word", "a: 0x1f\nb: 0o7\nc: 1e3\nd: 12:30",
        "a: 2026-11-21", "a: !!str 5\nb: !!float 5\nc: ! x", "a: |\n  two\n  lines\n", "---\na: 1\n...\n", "é: ü",
        "a: .inf", "true: 1\nno: 2", "# only a comment",
    ],
)  # fmt: skip
def test_plain_yaml_is_read_as_pyyaml_reads_it(text: str) -> None:
    assert load(text) == yaml.safe_load(text)


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("a: 1\nb: c: d", 3, "a `:` is not expected"),
        ("a: 1\nb:0\nc: 2\nd: 3", 3, "a space after the key"),
        ("a:\n\t- b", 3, "tab"),
        ("a: 1\nb: @x", 3, "quotes"),
        ("a: 1\nb: ?", 3, "a `?` is not expected"),
        ("a: 'x\nb: 1\n", 2, "never closed"),
        ("a: [1, 2\nb: 3", 3, "bracket"),
        ("a:\n  b: 1\n c: 2", 4, "indented"),
        ("a: 1\n---\nb: 1", 3, "second document"),
        ("a: 1\nb: 2\na: 3", 4, "`a` appears a second time; it is also in line 2"),
        ("1: a\n0x1: b", 3, "second time"),
        ("x:\n  y: 1\n  y: 2", 4, "second time"),
        ("a: 1\nb: !!python/object/apply:os.system [ls]", 3, "type"),
        ("a: 1\nb: !!binary abc", 3, "type"),
        ("a: 1\nb: !mine abc", 3, "type"),
        ("a: 1\nb: !!int x", 3, "`x` is not a whole number"),
        ("a: 1\nb: !!int ''", 3, "not a whole number"),
        ("a: 1\nb: !!bool x", 3, "not `true` or `false`"),
        ("a: 1\nb: !!float x", 3, "not a number"),
        ("a: 1\nb: 2026-13-45", 3, "not a date"),
        ("a: 1\nb: 0000-00-00", 3, "not a date"),
        ("a: 1\nb: 2001-12-14t21:59:43.10+99:99", 3, "not a date"),
        ("a: 1\nb: " + "9" * 5000, 3, "longer than"),
        ("a: 1\nb: 0x" + "f" * 5000, 3, "longer than"),
        ("a: 1\nb: 1" + ":59" * 3000, 3, "longer than"),
        ("a: 1\nb: =", 3, "quotes"),
        ("a: 1\n? [b]\n: c", 3, "a key is"),
        ("a: 1\nb: \x07", 3, "cannot be printed"),
        ("a: 1\nb: \ud800", 3, "cannot be printed"),
        ("a: 1\nb: " + "[" * 3000, 3, "nested more than 40 levels"),
        ("- 1\n" * 6000, VALUES + 1, "more than"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_a_sentence_with_the_line_of_the_cell(text: str, line: int, words: str) -> None:
    error = refused(text)
    assert error.place == f"line {line} of the cell" and error.place in str(error) and words in str(error)


@pytest.mark.parametrize(
    "text",
    [
        "a: &x [1, 2]\nb: *x",
        "a: &x {c: 1, d: [2]}\nb: {<<: *x, c: 3}\ne: {<<: [*x, {f: 4}]}",
        "a: &x 1\nb: &y [*x]\nc: [*y, *y]",
    ],
)
def test_anchors_are_read_as_pyyaml_reads_them(text: str) -> None:
    assert load(text) == load(text, table=True) == yaml.safe_load(text)


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("a: 1\nb: &x [*x]", 3, "`*x` is inside the value that it repeats"),
        ("a: 1\nb: *x", 3, "no anchor with this name"),
        ("a: &x 1\nb: &x 2", 3, "two anchors have this name"),
        ("a: 1\nb: {<<: 3}", 3, "`<<` takes a mapping"),
        ("a: &x [" + "1, " * (VALUES // 2) + "]\nb: *x", 3, "more than"),
        ("a: &x " + "[" * (DEPTH - 2) + "]" * (DEPTH - 2) + "\nb: [[[*x]]]", 3, "nested more than 40 levels"),
    ],
)
def test_what_an_alias_stands_for_counts_as_if_it_were_written_out(text: str, line: int, words: str) -> None:
    with pytest.raises(Refused, match=re.escape(words)) as caught:
        load(text)
    assert caught.value.place == f"line {line} of the cell"


def test_other_characters_that_end_a_line_do_not_shift_the_number() -> None:
    assert refused("a: 'x\u2028y\u2029z\x85'\nb: @").place == "line 3 of the cell"


@pytest.mark.parametrize(
    "text",
    [
        "a0: &a0 [x]\n" + "".join(f"a{n}: &a{n} [{f'*a{n - 1},' * 9}]\n" for n in range(1, 12)),
        "".join(f"a{n}: &a{n}\n  <<: [*a{n - 1}, *a{n - 1}]\n" for n in range(1, 2000)),
        *(opening * (FILE_BYTES // len(opening)) for opening in (
            "[", "{", "[{", "? ", "- ", "a: ", "!", "&", "*", "{a: ", "[a,", "? a\n", "a\n", '"\n\n', "'", "%",
            "#", "\n", " ", "-", "| \n", "[a:", "{?", "!<", "\\", "é", "\u2028", "\t", ": ", "a:\n ", "- a\n ",
            "---\n", "...\n",
        )),
        "a: " + "[" * (DEPTH + 1) + "]" * (DEPTH + 1), "x" * (FILE_BYTES + 1), "é" * (FILE_BYTES // 2 + 1),
    ],
    ids=lambda text: ascii(text[:12]),
)  # fmt: skip
def test_nothing_of_64_kib_takes_long_or_gets_out_as_something_else(text: str) -> None:
    # A hundredth of a second each; whatever grew with the square of the length would keep this test for minutes.
    with contextlib.suppress(Refused):
        load(text)


pieces = st.sampled_from(
    [
        "a", "b", "1", "0x", "9" * 30, ": ", "- ", "\n", "\n  ", "[", "]", "{", "}", ",", "&x ", "*x", "<<", "!!int ",
        "!!bool ", "!!map ", "!x ", "!", "'", '"', "\\", "|\n", ">\n", "#", "%", "@", "? ", "---\n", "...",
        "2026-99-01", "1:99", ".5", ".nan", "e+999", "=", "~", "\t", "\r", "\x00", "\u2028", "\ufeff", "é",
        "\ud800", "yes",
    ]
)  # fmt: skip


@settings(max_examples=400)
@given(st.lists(pieces, max_size=40).map("".join) | st.text(max_size=60))
def test_any_text_is_either_what_pyyaml_makes_of_it_or_a_sentence(text: str) -> None:
    try:
        found = load(text)
    except Refused as error:
        line = re.fullmatch(r"line (\d+) of the cell", error.place)
        assert not error.place or (line and 2 <= int(line[1]) <= text.count("\n") + 2)
    else:
        assert repr(found) == repr(yaml.safe_load(text))


def test_a_file_is_read_or_named(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    with pytest.raises(Refused, match=r"No cell that begins with `%%file a\.yaml`") as caught:
        read(path)
    assert caught.value.reason.code == "file-missing"
    path.write_bytes(b"a: \xff")
    with pytest.raises(Refused, match="not text"):
        read(path)
    path.write_bytes(b"\xff" * (FILE_BYTES + 1))
    with pytest.raises(Refused, match="larger than 64 KiB"):
        read(path)
    path.write_text("a: ü", encoding="utf-8")
    assert read(path) == {"a": "ü"}


def test_in_a_table_a_line_that_stands_twice_costs_itself_only() -> None:
    read = load("a: &same none\nb: *same\nc: 1\nd: 2\nc: 3\n", table=True)
    assert {key: read[key] for key in "abd"} == {"a": "none", "b": "none", "d": 2}
    assert str(read["c"]) == "appears twice, in lines 4 and 6 of the cell"
