"""What `tests/tools/margins.py` runs before a lab's check cells: it notes each bound on time and what was measured.

It runs in the grading worker and changes nothing of what a check does or decides. The notes leave the sandbox as a flag
of the check's result, as JSON behind `NOTE`. A note is `[line, what, kind, held, value, bound]`; `kind` is `wait`, `<`
or `>`, and a wait without a value ended without what it waited for. Of several of one place the one nearest to its
bound is kept.
"""

import ast
import json
import linecache
import statistics
import sys
import time
import types

from autograder.checks import current
from autograder.checks.expect import rates
from autograder.checks.expect.activity import Activity
from autograder.checks.expect.goal import SentGoal
from autograder.checks.expect.topic import Topic
from autograder.graph.observer import Observer

NOTE = "margin "
_notes: dict = {}
_flags: list = []


def _line():
    """The number and the text of the check cell's line that is run."""
    frame = sys._getframe(1)
    while frame is not None:
        name = frame.f_code.co_filename
        if name.startswith("<check "):
            return frame.f_lineno, linecache.getline(name, frame.f_lineno).strip()
        frame = frame.f_back
    return 0, ""


def _note(what, kind, held, value, bound):
    global _flags
    if current.check.findings.flags is not _flags:  # another check
        _flags = current.check.findings.flags
        _notes.clear()
    line, _ = _line()
    key = line, what, kind, bool(held)
    known = _notes.get(key)
    if known is None or value is None or known[4] is None or _apart(value, bound) < _apart(known[4], known[5]):
        _notes[key] = [line, what, kind, bool(held), value, bound]
    said = NOTE + json.dumps(list(_notes.values()))
    place = next((place for place, flag in enumerate(_flags) if flag.startswith(NOTE)), len(_flags))
    _flags[place : place + 1] = [said]


def _apart(value, bound):
    """How many times the one is the other, the larger the smaller."""
    small, large = sorted((abs(value), abs(bound)))
    return large / small if small else float("inf")


def _held(left, sign, right, text):
    """A comparison in what a check requires, noted."""
    held = {"<": lambda: left < right, "<=": lambda: left <= right, ">": lambda: left > right}.get(
        sign, lambda: left >= right
    )()
    if isinstance(left, float) or isinstance(right, float):
        _note(text, sign[0], held, float(left), float(right))
    return held


_SIGNS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">="}


class _Compares(ast.NodeTransformer):
    def visit_Compare(self, node):
        sign = _SIGNS.get(type(node.ops[0]))
        if len(node.ops) > 1 or sign is None:
            return node
        text = ast.Constant(ast.unparse(node))
        call = ast.Call(ast.Name("_held", ast.Load()), [node.left, ast.Constant(sign), node.comparators[0], text], [])
        return ast.copy_location(call, node)


class _Required(ast.NodeTransformer):
    def visit_Call(self, node):
        self.generic_visit(node)
        if isinstance(node.func, ast.Attribute) and node.func.attr == "require" and node.args:
            node.args[0] = _Compares().visit(node.args[0])
        return node


def _parse(source, filename="<unknown>"):
    return ast.fix_missing_locations(_Required().visit(ast.parse(source, filename)))


def _noting_waits(wait):
    def noted(self, ready, within, give_up=None):
        asked = sys._getframe(1).f_code.co_name
        began = time.monotonic()
        came = wait(self, ready, within, give_up)
        took = time.monotonic() - began
        if within > 0:
            what = "" if asked in ("wait", "_wait", "<lambda>") else asked
            _, text = _line()
            _note(f"{text} ({what})" if what else text, "wait", came, took if came else None, within)
        return came

    return noted


def _note_pace(gaps, period, tolerance):
    if gaps:
        off = abs(statistics.median(gaps) - period) / period
        _note(f"{_line()[1]} (off its period)", "<", off <= tolerance, off, tolerance)


def _noting_rates(method):
    def noted(self, wanted, tolerance, within):
        try:
            method(self, wanted, tolerance, within)
        finally:
            if wanted.rate is not None:
                gaps = rates._gaps(wanted.counted()[-wanted.need :], wanted.where is None)
                _note_pace(gaps, 1 / wanted.rate, tolerance)

    return noted


def _noting_feedback(method):
    def noted(self, rate, tolerance, hint):
        if rate is not None:
            _note_pace(rates._gaps(self.heard, True), 1 / rate, tolerance)
        method(self, rate, tolerance, hint)

    return noted


def _noting_periods(method):
    def noted(self, names, period, *, tolerance=0.2, **rest):
        try:
            method(self, names, period, tolerance=tolerance, **rest)
        finally:
            for name in names:
                _note_pace(self.seen().gaps(name), period, tolerance)

    return noted


Observer.wait = _noting_waits(Observer.wait)
Topic._at_rate = _noting_rates(Topic._at_rate)
SentGoal._keep_their_rate = _noting_feedback(SentGoal._keep_their_rate)
Activity.expect_period = _noting_periods(Activity.expect_period)
for _worker in ("autograder.grading.worker", "__main__"):  # as it was forked, and as it was started
    if hasattr(sys.modules.get(_worker), "_run_cell"):
        vars(sys.modules[_worker])["ast"] = types.SimpleNamespace(**{**vars(ast), "parse": _parse})
