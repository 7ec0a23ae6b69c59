"""Launch files and what the real `ros2 launch` (launch 3.4.3, launch_ros 0.26.6) made of them: here it is the same.

`launch_cases/*.yaml` hold one list of cases each:

    launch: the list below `launch:` (`file:` is a whole file instead); `<cam>` stands for `pkg: lab` and `exec: cam`
    beside: further files of its folder
    given: launch arguments
    result: the nodes that run, with the topics that are renamed, the parameters and the words of their own;
        `refused` by both; `not covered` by the kit, which says so and runs nothing

`values.yaml` has parameter values only. Every command line that comes of a file goes to the real rclpy.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
import rclpy
import yaml
from places import TESTS
from rclpy.logging import LoggingSeverity, set_logger_level
from rclpy.node import Node
from rclpy.utilities import remove_ros_args

from autograder.launch_files import NodeAction, read_launch_file
from autograder.reasons import Refused

CASES = TESTS / "launch_cases"
NAMES = ("camera/image_color", "a", "b", "foo", "baz", "~/status", "/emergency_stop")
NOT_COVERED = re.compile("not covered|not allowed|there is no package|appears a second time")


def cases() -> list[Any]:
    found = []
    for path in sorted(CASES.glob("*.yaml")):
        if path.stem != "values":
            for number, case in enumerate(yaml.safe_load(path.read_text(encoding="utf-8")), start=1):
                found.append(pytest.param(case, id=f"{path.stem}-{number}"))
    return found


def values(table: str) -> list[Any]:
    return list(yaml.safe_load((CASES / "values.yaml").read_text(encoding="utf-8"))[table])


def full(text: str) -> str:
    """A file with `<cam>` written out, within braces or as lines."""
    text = re.sub(r"^( *)<cam>$", r"\1pkg: lab\n\1exec: cam", text, flags=re.MULTILINE)
    return text.replace("<cam>", "pkg: lab, exec: cam")


def read(folder: Path, text: str, given: dict[str, str] | None = None) -> list[NodeAction]:
    def find(package: str) -> Path:
        return {"lab": folder}[package]

    (folder / "main.launch.yaml").write_text(text, encoding="utf-8")
    return read_launch_file(folder / "main.launch.yaml", given or {}, find, ["cam", "camera_demo"])


def run(node: NodeAction) -> dict[str, Any]:
    """What the real rclpy makes of a node's command line."""
    words = ["cam", *node.arguments, "--ros-args", *node.ros_arguments()]
    context = rclpy.Context()
    try:
        rclpy.init(context=context, args=words)
    except Exception as error:
        return {"ends": "remap rule" if "remap rule" in str(error) else str(error)}
    real = Node("cam", context=context, automatically_declare_parameters_from_overrides=True)
    try:
        full_name = real.get_fully_qualified_name()
        found: dict[str, Any] = {"node": full_name}
        space = full_name.rsplit("/", 1)[0]
        for name in NAMES:
            own = {"/": name, "~": full_name + name[1:]}.get(name[0], f"{space}/{name}")
            if real.resolve_topic_name(name) != own:
                found.setdefault("topics", {})[name] = real.resolve_topic_name(name)
        for name, parameter in real._parameters.items():
            if name not in ("use_sim_time", "start_type_description_service"):
                value = parameter.value
                found.setdefault("parameters", {})[name] = list(value) if hasattr(value, "tolist") else value
        if remove_ros_args(words)[1:]:
            found["words"] = remove_ros_args(words)[1:]
        return found
    finally:
        real.destroy_node()
        rclpy.try_shutdown(context=context)
        set_logger_level("", LoggingSeverity.INFO)  # `--log-level` is for the whole process


def in_order(found: list[dict[str, Any]]) -> list[str]:
    return sorted(yaml.safe_dump(one) for one in found)


@pytest.mark.parametrize("case", cases())
def test_a_launch_file_does_what_ros2_launch_does_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, case: dict[str, Any]
) -> None:
    for name, text in case.get("beside", {}).items():
        (tmp_path / name).write_text(full(text), encoding="utf-8")
    text = full(case["file"] if "file" in case else "launch:\n" + case["launch"])
    monkeypatch.chdir(tmp_path)
    if isinstance(case["result"], str):
        with pytest.raises(Refused) as caught:
            read(tmp_path, text, case.get("given"))
        assert caught.value.reason.because
        if case["result"] == "not covered":
            assert NOT_COVERED.search(caught.value.reason.because), caught.value.reason.because
        return
    assert in_order([run(node) for node in read(tmp_path, text, case.get("given"))]) == in_order(case["result"])


@pytest.mark.parametrize("table", ["written", "substituted", "set_for_all"])
def test_a_value_gets_the_type_that_ros2_launch_gives_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, table: str
) -> None:
    monkeypatch.chdir(tmp_path)
    node = "- node: {pkg: lab, exec: cam, name: x"
    wrong = []
    for written, *expected in values(table):
        text = json.dumps(written)
        lists = {
            "written": f"{node}, param: [{{name: p, value: {written}}}]}}\n",
            "substituted": f"- let: {{name: v, value: {text}}}\n{node}, param: [{{name: p, value: $(var v)}}]}}\n",
            "set_for_all": f"- set_parameter: {{name: p, value: {text}}}\n{node}}}\n",
        }
        try:
            [launched] = read(tmp_path, "launch:\n" + lists[table])
            found = [run(launched)["parameters"]["p"]]
        except Refused:
            found = []
        if repr(found) != repr(expected):  # the types count, and nan is not equal to itself
            wrong.append((written, expected, found))
    assert wrong == []


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            "- let: {name: v0, value: ab}\n"
            + "".join(f"- let: {{name: v{n + 1}, value: $(var v{n})$(var v{n})}}\n" for n in range(25)),
            "grows longer than 8000",
        ),
        ("- include: {file: $(dirname)/main.launch.yaml}\n", "more than 8 deep"),
        ("- include: {file: $(dirname)/main.launch.yaml}\n" * 6, "more than 8 deep"),
        ("- log: {message: " + "$(var " * 11 + "v" + ")" * 11 + "}\n", "nested too deep"),
        ("- include: {file: $(dirname)/many.launch.yaml}\n" * 6, "more than 1000 actions"),
        ("- log: {message: \"$(eval '" + "(" * 400 + "1" + ")" * 400 + "')\"}\n", "$(eval"),
        ("- log: {message: \"$(eval ''a' * 10 ** 9')\"}\n", "in a substitution"),
        ('- log: {message: "$(eval \'\\"a\\" * 10 ** 9\')"}\n', "too long"),
        ("- log: {message: \"$(eval '2 ** 10000000')\"}\n", "too large"),
    ],
)
def test_what_grows_without_bound_is_refused(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "many.launch.yaml").write_text("launch:\n" + "- log: {message: x}\n" * 200)
    with pytest.raises(Refused) as caught:
        read(tmp_path, f"launch:\n{text}")
    assert told in str(caught.value)


def test_without_the_file_of_from_a_node_starts_and_a_warning_says_so(tmp_path: Path) -> None:
    (tmp_path / "p.yaml").write_text("/**:\n  ros__parameters: {p: 1}\n")
    [node] = read(tmp_path, "launch:\n- node: {pkg: lab, exec: cam, param: [{from: p.yaml}]}\n")
    assert node.parameters == []
    assert "looks for it in the folder that it is called from" in node.warnings[0]


def test_a_program_that_the_package_does_not_have_is_refused_with_those_it_has(tmp_path: Path) -> None:
    with pytest.raises(Refused, match="It has `cam`, `camera_demo`"):
        read(tmp_path, "launch:\n- node: {pkg: lab, exec: nope}\n")


def test_variables_reach_the_program(tmp_path: Path) -> None:
    [node] = read(
        tmp_path,
        "launch:\n- set_env: {name: MODE, value: fast}\n"
        "- node: {pkg: lab, exec: cam, env: [{name: SIDE, value: $(env MODE)er}]}\n",
    )
    assert node.environment == {"MODE": "fast", "SIDE": "faster"}
