"""Launch files in ROS 2's YAML schema: what they start, and what is said of those that cannot be read."""

from __future__ import annotations

from pathlib import Path

import nbformat
import pytest
import rclpy
import yaml
from places import ROOT
from rclpy.node import Node

from autograder.core.student_yaml import FILE_BYTES
from autograder.course.cells import parse
from autograder.course.lab import load_lab
from autograder.launch_files import (
    NodeAction,
    ParamsFile,
    declared_arguments,
    read_launch_file,
    remove_written,
)
from autograder.reasons import Refused

CAMERA = '- node: {pkg: "camera_lab", exec: "camera_demo"'


def read(folder: Path, text: str, **arguments: str) -> list[NodeAction]:
    def find(package: str) -> Path:
        return {"camera_lab": folder}[package]

    (folder / "a.launch.yaml").write_text(text)
    return read_launch_file(folder / "a.launch.yaml", arguments, find)


def refusal(folder: Path, text: str, **arguments: str) -> str:
    with pytest.raises(Refused) as caught:
        read(folder, text, **arguments)
    return str(caught.value)


@pytest.mark.parametrize("written", ["010", "0x10", "12:30", "on", "1_000", "Yes", "+5", "true", "1.50"])
@pytest.mark.parametrize("text", ["- arg:\n    name: rate\n    default: {}\n", "- let: {{name: rate, value: {}}}\n"])
def test_the_hint_to_put_a_value_in_quotes_keeps_what_was_written(tmp_path: Path, text: str, written: str) -> None:
    with pytest.raises(Refused) as caught:
        read(tmp_path, "launch:\n" + text.format(written))
    assert f'"{written}"`' in caught.value.reason.hint and f"`{written}` is a" in caught.value.reason.because
    quoted = caught.value.reason.hint.partition("`")[2].partition("`")[0].partition(": ")[2]
    read(tmp_path, "launch:\n" + text.format(quoted))


IN_PYTHON = """from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description():
    return LaunchDescription([
        DeclareLaunchArgument("side", default_value="front"),
        Node(package="camera_lab", executable="camera_demo", name=LaunchConfiguration("side"),
             remappings=[("image", "front/image")]),
    ])
"""


@pytest.mark.parametrize(
    "text",
    [IN_PYTHON, IN_PYTHON.partition("def ")[0] + "x = 1\n", "# a car\nimport launch\n" + IN_PYTHON,
     "import launch_ros.actions as a\nfrom launch import LaunchDescription as D\n", "x: 1\nLaunchDescription([])\n"],
)  # fmt: skip
def test_a_launch_file_in_python_is_called_so_and_its_words_are_translated(tmp_path: Path, text: str) -> None:
    with pytest.raises(Refused) as caught:
        read(tmp_path, text)
    assert "a launch file in Python" in caught.value.reason.because and "YAML" in caught.value.reason.because
    assert "`launch:`" in caught.value.reason.hint and "`- node:`" in caught.value.reason.hint
    if "remappings" in text:
        for words in ("`$(var NAME)`", "`remap:`", "`- arg:`"):
            assert words in caught.value.reason.hint
    assert "indentation" not in str(caught.value) + caught.value.reason.hint


@pytest.mark.parametrize("text", [
    "- node: {pkg: camera_lab, exec: camera_demo, name: $(optenv NAME x)}", "- lifecycle_node: {pkg: a, exec: b}",
    "- log_info: {message: a}", "- log: {message: a, level: INFO}",
])  # fmt: skip
def test_what_jazzy_does_not_have_is_not_said_to_be_missing_here(tmp_path: Path, text: str) -> None:
    said = refusal(tmp_path, f"launch:\n{text}\n")
    assert "not covered here" not in said.replace("is unknown or not covered here", "")


def test_a_node_gets_its_name_namespace_rules_and_parameters_in_order(tmp_path: Path) -> None:
    (tmp_path / "camera.params.yaml").write_text("")
    [node] = read(
        tmp_path,
        """
launch:
- node:
    pkg: "camera_lab"
    exec: "camera_demo"
    name: "rear_demo"
    namespace: "vehicle/back"
    args: "--verbose 'two words'"
    remap:
    - {from: "a", to: "b"}
    - {from: "c", to: "d"}
    param:
    - {name: "rate", value: 5}
    - {from: "$(dirname)/camera.params.yaml"}
    - {name: "gain", value: 2.0}
""",
    )
    assert (node.program, node.name, node.namespace) == ("camera_demo", "rear_demo", "/vehicle/back")
    assert node.arguments == ["--verbose", "two words"]
    assert isinstance(node.parameters[1], ParamsFile)
    words = node.ros_arguments()
    assert words[:4] == ["-r", "__node:=rear_demo", "-r", "__ns:=/vehicle/back"]
    assert words[4:10:2] == ["--params-file"] * 3
    assert words[7] == "camera.params.yaml"
    written = [yaml.safe_load((tmp_path / name).read_text()) for name in (words[5], words[9])]
    assert written == [
        {"/vehicle/back/rear_demo": {"ros__parameters": {name: value}}} for name, value in (("rate", 5), ("gain", 2.0))
    ]
    assert words[10:] == ["-r", "a:=b", "-r", "c:=d"]
    remove_written(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.launch.yaml", "camera.params.yaml"]


def test_arguments_have_defaults_and_are_given_from_outside(tmp_path: Path) -> None:
    text = 'launch:\n- arg: {name: "side", default: "left"}\n' + CAMERA + ', name: "$(var side)_demo"}\n'
    assert [node.name for node in read(tmp_path, text)] == ["left_demo"]
    assert [node.name for node in read(tmp_path, text, side="right")] == ["right_demo"]


def test_an_argument_without_a_value_is_named(tmp_path: Path) -> None:
    assert "`side` has no value" in refusal(tmp_path, 'launch:\n- arg: {name: "side"}\n')


@pytest.mark.parametrize(
    ("written", "value"),
    [
        ("40", 40),
        ('"40"', "40"),
        ('"$(var rate)"', 25),
        ('"$(var rate).0"', 25.0),
        ("\"'40'\"", "'40'"),
        ("\"'$(var rate)'\"", "25"),
        ('"$(var side)_camera"', "rear_camera"),
        ("true", True),
        ("[1, 2]", [1, 2]),
        ('"[1, 2]"', "[1, 2]"),
        ('"[$(var rate), 2]"', [25, 2]),
    ],
)
def test_a_literal_keeps_its_type_and_what_has_a_substitution_is_read_as_yaml(
    tmp_path: Path, written: str, value: object
) -> None:
    text = f"launch:\n{CAMERA}, param: [{{name: p, value: {written}}}]}}\n"
    [node] = read(tmp_path, text, rate="25", side="rear")
    assert node.parameters[0].model_dump() == {"name": "p", "value": value}


def test_nested_parameters_become_dotted_names(tmp_path: Path) -> None:
    text = (
        f"launch:\n{CAMERA}, param: [{{name: limits, param: [{{name: top, value: 1}}, {{name: low, value: 0}}]}}]}}\n"
    )
    [node] = read(tmp_path, text)
    assert node.ros_arguments() == ["-p", "limits.top:=1", "-p", "limits.low:=0"]


def test_a_pushed_namespace_ends_with_its_group(tmp_path: Path) -> None:
    text = f"""
launch:
- group:
  - push_ros_namespace: {{namespace: "outer"}}
  - group:
    - push-ros-namespace: {{namespace: "inner"}}
    {CAMERA}}}
    {CAMERA}, namespace: "below"}}
    {CAMERA}, namespace: "/absolute"}}
  {CAMERA}}}
{CAMERA}}}
"""
    spaces = [node.namespace for node in read(tmp_path, text)]
    assert spaces == ["/outer/inner", "/outer/inner/below", "/absolute", "/outer", ""]


def test_rules_and_parameters_of_a_group_come_before_those_of_its_nodes(tmp_path: Path) -> None:
    text = f"""
launch:
- group:
  - set_remap: {{from: "a", to: "b"}}
  - set_parameter: {{name: "p", value: "1"}}
  {CAMERA}, remap: [{{from: "a", to: "c"}}], param: [{{name: "p", value: 2}}]}}
{CAMERA}}}
"""
    inside, outside = read(tmp_path, text)
    assert inside.ros_arguments() == ["-p", "p:=1", "-p", "p:=2", "-r", "a:=b", "-r", "a:=c"]
    assert outside.ros_arguments() == []


@pytest.mark.parametrize(
    ("condition", "starts"), [('if: "true"', 1), ('if: "$(var on)"', 0), ('unless: "$(var on)"', 1), ('unless: "1"', 0)]
)
def test_conditions(tmp_path: Path, condition: str, starts: int) -> None:
    assert len(read(tmp_path, f"launch:\n{CAMERA}, {condition}}}\n", on="False")) == starts


def test_the_courses_file_can_stand_in_for_an_included_one_and_names_its_own_program(tmp_path: Path) -> None:
    (tmp_path / "inner.launch.yaml").write_text("a student's file that cannot be read")
    (tmp_path / "course.launch.yaml").write_text(
        'launch:\n- arg: {name: side}\n- node: {pkg: camera_lab, exec: course, args: "$(var side)"}\n'
    )
    outer = tmp_path / "outer.launch.yaml"
    include = "launch:\n- include: {file: $(dirname)/inner.launch.yaml, arg: [{name: side, value: left}]}\n"

    def started(text: str) -> list[tuple[str, list[str]]]:
        outer.write_text(text)
        found = read_launch_file(outer, {}, None, ["camera_demo"], {"inner.launch.yaml": "course.launch.yaml"})
        return [(node.program, node.arguments) for node in found]

    assert started(include) == [("course", ["left"])]
    with pytest.raises(Refused, match=r"`inner\.launch\.yaml` has no default for it"):
        started(include.replace("side, value", "other, value"))
    with pytest.raises(Refused, match=r"has no program `course`\. It has `camera_demo`"):
        started("launch:\n- node: {pkg: camera_lab, exec: course}\n")


def test_what_an_included_file_sets_stays_set_unless_a_group_holds_it(tmp_path: Path) -> None:
    (tmp_path / "inner.launch.yaml").write_text(
        'launch:\n- arg: {name: "side"}\n- push_ros_namespace: {namespace: "$(var side)"}\n' + CAMERA + "}\n"
    )
    include = (
        '- include: {file: "$(find-pkg-share camera_lab)/launch/inner.launch.yaml", arg: [{name: side, value: a}]}\n'
    )
    leaks = read(tmp_path, f"launch:\n{include}{CAMERA}, name: $(var side)}}\n")
    assert [node.namespace for node in leaks] == ["/a", "/a"]
    held = read(tmp_path, f"launch:\n- group:\n  {include}{CAMERA}}}\n")
    assert [node.namespace for node in held] == ["/a", ""]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("launch:\n- node:\n\tpkg: x\n", "line 4 of the cell: it is not YAML"),
        ("- node: {}\n", "one key at the top"),
        ("launch: {node: {}}\n", "`launch:` has a list below it"),
        ("launch:\n- node: {pkg: camera_lab, exec: a}\n  name: x\n", "entry 1: each entry"),
        ("launch:\n- node: {pkg: camera_lab}\n", "the key `exec` is missing"),
        ("launch:\n- node: {pkg: other, exec: a}\n", "there is no package `other`"),
        (f"launch:\n{CAMERA}, remaps: []}}\n", "the key `remaps` is unknown or not covered"),
        (f"launch:\n{CAMERA}, remap: {{from: a, to: b}}}}\n", "remap: a list is expected"),
        (f"launch:\n{CAMERA}, remap: [{{from: a}}]}}\n", "remap (entry 1): the key `to` is missing"),
        (f"launch:\n{CAMERA}, name: 2nd}}\n", "`2nd` cannot name a node"),
        (f"launch:\n{CAMERA}, name: /front}}\n", "`/front` cannot name a node"),
        (f"launch:\n{CAMERA}, namespace: front-left}}\n", "`/front-left` cannot be a namespace"),
        (f"launch:\n{CAMERA}, name: $(var side)}}\n", "no launch argument `side`"),
        (f'launch:\n{CAMERA}, name: "$(env HOME)"}}\n', "`HOME` differs from machine to machine"),
        (f'launch:\n{CAMERA}, name: "$(var side"}}\n', "never closed"),
        (f"launch:\n{CAMERA}, if: maybe}}\n", "a condition is true, false"),
        ("launch:\n- arg: {name: rate, default: 10}\n", "`10` is a number; the launch schema wants a text"),
        ("launch:\n- executable: {cmd: ls}\n", "`executable` is not covered"),
        ("launch:\n- include: {file: other.launch.yaml}\n", "there is no file `other.launch.yaml`"),
        ("launch:\n- include: {file: /etc/passwd}\n", "there is no file `passwd` there"),
        ("launch:\n- include: {file: $(dirname)/a.launch.yaml}\n", "more than 8 deep"),
        ("launch: &all\n- group: *all\n", "`*all` is inside the value that it repeats"),
        (f"launch:\n{CAMERA}, param: [{{name: p, value: {{}}}}]}}\n", "a parameter is a bool"),
        ("launch:\n" + f"{CAMERA}}}\n" * 33, "more than 32 nodes"),
        ("launch: [" + "[" * 5000 + "]" * 5000 + "]", "nested more than 40 levels"),
        ("#" * (FILE_BYTES + 1), "larger than 64 KiB"),
    ],
)
def test_what_cannot_be_read_is_said_with_its_place(tmp_path: Path, text: str, told: str) -> None:
    message = refusal(tmp_path, text)
    assert told in message
    assert message.startswith("a.launch.yaml")


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        (f'launch:\n{CAMERA}, name: "$(arg side)"}}\n', "In ROS 2 it is `$(var NAME)`"),
        (f'launch:\n{CAMERA}, name: "${{side}}"}}\n', "`$(var NAME)`"),
        ("launch:\n- group:\n    include: {file: x}\n", "Write a list below `group:`"),
        ("launch:\n- include: {file: $(dirname)/a_launch.yaml}\n", "Is `a.launch.yaml` meant?"),
        (f"launch:\n- arg: {{name: drive, default: 'true'}}\n{CAMERA}, if: drive}}\n", "argument is `$(var drive)`"),
    ],
)
def test_what_is_often_meant_is_in_the_hint(tmp_path: Path, text: str, hint: str) -> None:
    (tmp_path / "a.launch.yaml").write_text(text)
    with pytest.raises(Refused) as caught:
        read_launch_file(tmp_path / "a.launch.yaml", {})
    assert hint in caught.value.reason.hint


@pytest.mark.parametrize(("content", "told"), [(b"a: \xe4", "text in UTF-8"), (b"#" * (FILE_BYTES + 1), "larger than")])
def test_a_parameter_file_with_substitutions_that_is_no_text_is_refused(
    tmp_path: Path, content: bytes, told: str
) -> None:
    (tmp_path / "p.yaml").write_bytes(content)
    text = f"launch:\n{CAMERA}, param: [{{from: $(dirname)/p.yaml, allow_substs: true}}]}}\n"
    assert told in refusal(tmp_path, text)


def test_an_argument_that_is_spelt_otherwise_is_named(tmp_path: Path) -> None:
    text = f'launch:\n- arg: {{name: side, default: x}}\n{CAMERA}, name: "$(var sied)"}}\n'
    assert "`side` is there; is that meant?" in refusal(tmp_path, text)


def test_the_arguments_that_a_file_declares_are_known(tmp_path: Path) -> None:
    (tmp_path / "a.launch.yaml").write_text(
        "launch:\n- arg: {name: side}\n- group:\n  - arg: {name: rate, default: x}\n"
    )
    assert declared_arguments(tmp_path / "a.launch.yaml") == ["side", "rate"]


def test_a_file_that_is_missing(tmp_path: Path) -> None:
    with pytest.raises(Refused, match="there is no such file"):
        read_launch_file(tmp_path / "a.launch.yaml", {})


def test_a_real_node_takes_every_value_with_its_type(tmp_path: Path) -> None:
    values = {"i": 40, "d": 40.0, "s": "40", "b": False, "words": ['a "quoted" word', "b"], "numbers": [1.0, 2.5]}
    listed = ", ".join(
        f"{{name: {name}, value: {value!r}}}" if name != "s" else "{name: s, value: '40'}"
        for name, value in values.items()
        if name not in ("words", "b")
    )
    text = f"launch:\n{CAMERA}, name: x, namespace: y, param: [{listed}, {{name: b, value: false}}"
    text += ", {name: words, value: ['a \"quoted\" word', b]}]}\n"
    [launched] = read(tmp_path, text)
    context = rclpy.Context()
    rclpy.init(context=context, args=["x", "--ros-args", *launched.ros_arguments()])
    node = Node("camera_demo", context=context)
    try:
        assert node.get_fully_qualified_name() == "/y/x"
        assert {name: node.declare_parameter(name, value).value for name, value in values.items()} == values
    finally:
        node.destroy_node()
        rclpy.try_shutdown(context=context)


@pytest.mark.parametrize("sides", [{}, {"vehicle": "car"}])
def test_the_labs_own_launch_files_can_be_read(tmp_path: Path, sides: dict[str, str]) -> None:
    for cell in nbformat.read(load_lab(ROOT, "lab3_remapping").notebook, as_version=4).cells:
        file = parse(cell.source) if cell.cell_type == "code" else None
        if file and file.name.endswith(".launch.yaml"):
            text = "\n".join(line for line in file.text.splitlines() if "### " not in line)
            (tmp_path / file.name).write_text(text)
    nodes = read_launch_file(tmp_path / "vehicle.launch.yaml", sides)
    space = sides.get("vehicle", "vehicle")
    assert [f"{node.namespace}/{node.name}" for node in nodes] == [
        f"/{space}/{side}_demo" for side in ("right", "left", "rear")
    ]


def test_a_file_can_be_read_as_inside_a_namespace(tmp_path: Path) -> None:
    file = tmp_path / "a.launch.yaml"
    file.write_text(f"launch:\n{CAMERA}, namespace: inner}}\n{CAMERA}, namespace: /fixed}}\n")
    nodes = read_launch_file(file, {}, around="/area")
    assert [node.namespace for node in nodes] == ["/area/inner", "/fixed"]
