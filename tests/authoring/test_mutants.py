"""The rules that make mutants, and the file that decides what survives; `make mutants` grades them all."""

from __future__ import annotations

import ast

import mutants
import pytest
from places import ROOT

from autograder.authoring.mutation.mutants import handed_in, reached, using
from autograder.authoring.mutation.mutants import mutants as made_from
from autograder.authoring.mutation.rules import Source, changes, swaps, text_changes, without_a_line
from autograder.course.lab import load_lab

PROGRAM = """\
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Int64, String

class Talker(Node):
    def __init__(self):
        super().__init__("talker")
        self.declare_parameter("period", 0.5)
        self.group = MutuallyExclusiveCallbackGroup()
        self.out = self.create_publisher(String, "~/é", QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE))
        self.create_timer(self.period, self.tick, callback_group=self.group)

    def tick(self):
        if self.count < 5 and not self.done:
            self.count += 1
        for word in self.words:
            self.out.publish(String(data=word))
        self.last = max(self.words[0], self.limit * 0.5)
"""


def lines_after(rule: str) -> set[str]:
    """What the changed lines look like for the changes of one rule."""
    source = Source(PROGRAM)
    lines = set(range(1, PROGRAM.count("\n") + 1))
    texts = [source.with_change(c) for c in (*changes(PROGRAM, lines), *swaps(PROGRAM, lines)) if c.rule == rule]
    return {next(b for a, b in zip(PROGRAM.split("\n"), t.split("\n"), strict=False) if a != b).strip() for t in texts}


@pytest.mark.parametrize(
    ("rule", "line"),
    [
        ("qos policy", "reliability=ReliabilityPolicy.BEST_EFFORT"),
        ("name", '"/é"'),
        ("name", 'String, "é"'),
        ("name", '"~/éx"'),
        ("type", 'create_publisher(Int64, "~/é"'),
        ("callback group", "self.group = ReentrantCallbackGroup()"),
        ("without callback_group", "self.create_timer(self.period, self.tick)"),
        ("without reliability", "QoSProfile(depth=1)"),
        ("timer period", "self.create_timer(2 * (self.period), self.tick"),
        ("parameter name", '"periodx"'),
        ("parameter type", 'self.declare_parameter("period", 0)'),
        ("node name", 'super().__init__("talkerx")'),
        ("comparison", "self.count <= 5"),
        ("without not", "self.count < 5 and self.done"),
        ("and, or", "(self.count < 5) or (not self.done)"),
        ("arithmetic", "self.count -= 1"),
        ("number", "depth=2"),
        ("dropped create_timer()", "pass"),
        ("dropped method", "pass"),
        ("order", "self.group = MutuallyExclusiveCallbackGroup()"),
        ("only the first time", "if not vars(self).setdefault('_once', []): self._once.append(1); self.out.publish("),
        ("all but the first time", "if vars(self).setdefault('_once', []) or self._once.append(1): self.count += 1"),
        ("only the first", "for word in list(self.words)[:1]:"),
        ("all but the first", "for word in list(self.words)[1:]:"),
        ("first, last", "self.words[-1]"),
        ("lowest, highest", "self.last = min("),
        ("number", "self.limit * 1.0"),
        ("number", "self.limit * 0.25"),
    ],
)
def test_each_rule_changes_one_thing_and_leaves_the_rest_as_it_was(rule: str, line: str) -> None:
    assert any(line in changed for changed in lines_after(rule)), lines_after(rule)


def test_a_change_outside_the_students_lines_is_not_made() -> None:
    assert {c.rule for c in changes(PROGRAM, {7})} == {"node name", "dropped __init__()"}


def test_rules_files_and_tables_are_changed_word_by_word() -> None:
    made = dict.fromkeys(changed for _, changed in text_changes("rear: -r __ns:=/rear -r image:=/a/image\nrate: 5\n"))
    for wanted in ("-r image:=a/image", "-r /image:=", "rate: 6", 'rate: "5"', "rear: -r __ns:=/rear\n"):
        assert any(wanted in changed for changed in made), wanted


def test_of_a_packages_files_programs_are_changed_and_of_set_up_files_lines_are_left_out() -> None:
    made = {mutant.key for mutant in made_from(load_lab(ROOT, "lab7_interfaces"))}
    assert any(key.startswith("sensors_speed_monitor: comparison: ") for key in made)
    assert 'lights_setup_py: dropped line: packages=["car_lights"], => (dropped)' in made
    assert [*without_a_line("<a>\n  <b>c</b>\n</a>")] == ["  <b>c</b>\n</a>", "<a>\n</a>"]


@pytest.mark.parametrize("name", mutants.kill_matrix.labs())
def test_mutants_of_a_lab_differ_from_the_solution_are_programs_and_reach_a_check(name: str) -> None:
    lab = load_lab(ROOT, name)
    found = made_from(lab)
    assert len({mutant.key for mutant in found}) == len(found) > 100
    for mutant in found:
        file = lab.answers[mutant.answer].file
        assert mutant.source != lab.answers[mutant.answer].solution
        assert any(cell.points for cell in reached(lab, [mutant.answer])), mutant.answer
        if file is not None and file.file_name.endswith(".py"):
            ast.parse(handed_in(lab, mutant)[file.file_name])


@pytest.mark.parametrize("name", mutants.kill_matrix.labs())
def test_every_decided_survivor_is_a_mutant_of_the_solution_as_it_is(name: str) -> None:
    keys = {mutant.key for mutant in made_from(load_lab(ROOT, name))}
    verdicts = mutants.decided(name)
    assert [key for key in verdicts if key not in keys] == []
    assert set(verdicts.values()) <= set(mutants.VERDICTS)


LABS_WITH_FUNCTIONS = {
    "lab2_executors": {"check_heartbeat": {"heartbeat"}, "check_adder": {"adder"}},
    "lab5_qos": {"check_guard": {"controller", "guard"}, "check_car": {"car"}},
}
"""The answers that reach some checks of labs whose set-up has functions about single programs."""


def test_a_function_of_the_set_up_that_uses_a_program_concerns_only_the_checks_that_call_it() -> None:
    for name, wanted in LABS_WITH_FUNCTIONS.items():
        lab = load_lab(ROOT, name)
        found = {check.grade_id: using(lab, check) for check in lab.checks}
        assert {check: found[check] for check in wanted} == wanted
