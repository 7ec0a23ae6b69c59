"""Why a remap rule or a parameter file did nothing: each reason is held against what the real rclpy does."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import rclpy
from rclpy.node import Node
from std_msgs.msg import String

from autograder.arguments import params_file, remap_rules, rule_effect
from autograder.arguments.rule_effect import RULE_WITHOUT_MATCH


@contextmanager
def started(*words: str) -> Iterator[Node]:
    """A camera with these words after `--ros-args`."""
    context = rclpy.Context()
    rclpy.init(context=context, args=["camera", "--ros-args", *words])
    node = Node("camera_demo", context=context)
    node.create_publisher(String, "camera/image_color", 1)
    node.create_publisher(String, "~/status", 1)
    try:
        yield node
    finally:
        node.destroy_node()
        rclpy.try_shutdown(context=context)


def names(rules: list[str]) -> tuple[str, list[str]]:
    with started(*(word for rule in rules for word in ("-r", rule))) as node:
        own = [publisher.topic_name for publisher in node.publishers]
        return node.get_fully_qualified_name(), [name for name in own if name not in ("/rosout", "/parameter_events")]


@pytest.mark.parametrize(
    ("rule", "code"),
    [
        ("__node:=/front", "slash-in-node-name"),
        ("__ns:=front", "namespace-without-slash"),
        ("__ns:=/2nd", "begins-with-digit"),
        ("__node:=2nd", "begins-with-digit"),
        ("a:=front/2nd", "begins-with-digit"),
        ("__node:=front-demo", "name-characters"),
        ("*/a:=b", "wildcard"),
        ("a=b", "rule-form"),
        ("~status:=/diag", "name-form"),
        ("image-color:=image", "name-characters"),
        ("__NS:=/front", "rule-special"),
        ("a__b:=c", "double-underscore"),
        ("a:=b/", "name-slash"),
        ("a:=", "name-empty"),
        ("a: =b", "rule-form"),
        ("/front/camera_demo:a:=b", "rule-colon"),
        ("a:=rostopic://b", "rule-scheme"),
    ],
)
def test_a_rule_that_rcl_refuses_is_explained(rule: str, code: str) -> None:
    with pytest.raises(Exception, match="arse remap rule"):
        names([rule])
    reason = remap_rules.refused(["a:=b", rule])
    assert reason is not None
    assert reason.code == code


@pytest.mark.parametrize(
    "rule",
    ["a:=b", "~/a:=/b", "/a/b:=c_2", "camera:a:=b", "__ns:=/x/y", "camera_demo:__node:=x", "rostopic://a:=b", "a:=~/b"],
)
def test_a_rule_that_rcl_takes_is_not_blamed(rule: str) -> None:
    names([rule])
    assert remap_rules.refused([rule]) is None


@pytest.mark.parametrize(
    ("rules", "wanted", "code"),
    [
        (["camera/image_colour:=image"], "/image", "rule-without-match"),
        (["image_color:=image"], "/image", "rule-without-match"),
        (["camera/image_color:=a", "a:=image"], "/image", "rules-do-not-chain"),
        (["a:=image", "camera/image_color:=a"], "/image", "rules-do-not-chain"),
        (["camera/image_color:=a", "camera/image_color:=image"], "/image", "rule-order"),
        (["__node:=rear", "camera_demo:camera/image_color:=image"], "/image", "rule-prefix"),
        (["__node:=rear", "/camera_demo/status:=image"], "/image", "private-rule"),
        (["__node:=rear", "camera_demo/status:=image"], "/image", "private-rule"),
        (["__ns:=/x", "/camera/image_color:=image"], "/x/image", "absolute-rule"),
        (["__ns:=/x", "camera/image_color:=/image"], "/x/image", "absolute-rule"),
        (["__ns:=/x", "camera/image_color:=x/image"], "/x/image", "topic-name"),
        (["__ns:=/x", "camera/image_color:=~/image"], "/x/image", "private-rule"),
        (["front/image:=camera/image_color"], "/front/image", "rule-takes-name"),
    ],
)
def test_a_rule_without_effect_is_explained(rules: list[str], wanted: str, code: str) -> None:
    node, topics = names(rules)
    assert wanted not in topics
    reason = rule_effect.without_effect(rules, wanted, [node], topics)
    assert reason is not None
    assert reason.code == code


def test_a_swapped_rule_is_told_from_one_that_is_misspelt() -> None:
    node, topics = names(["front/image:=camera/image_color"])
    in_code = {f"/{name}": [node] for name in ("camera/image_color", "camera_demo/status")}
    for rule, said in (("front/image:=camera/image_color", True), ("camera/image_colour:=front/image", False)):
        reason = rule_effect.without_effect([rule], "/front/image", [node], topics, in_code)
        assert reason is not None and ("swapped" in reason.because) == said


@pytest.mark.parametrize(("space", "wanted"), [("", "/camera/image_color"), ("/car", "/car/camera/image_color")])
@pytest.mark.parametrize("known", [True, False])
def test_a_rule_that_worked_is_not_said_to_have_changed_nothing(space: str, wanted: str, known: bool) -> None:
    rules = [*([f"__ns:={space}"] if space else []), "camera/image_color:=/front/image"]
    node, topics = names(rules)
    assert "/front/image" in topics and wanted not in topics
    in_code = {wanted: [node], f"{node}/status": [node]} if known else None
    reason = rule_effect.without_effect(rules, wanted, [node], topics, in_code)
    assert reason is not None and reason.code == "rule-takes-name" and "leave the rule out" in reason.hint.lower()
    assert "changed nothing" not in reason.because and "swapped" not in reason.because
    assert ("swapped" in reason.hint) != known


def test_what_renames_no_node_is_told() -> None:
    assert names(["camera_demo:=front"])[0] == "/camera_demo"
    found = rule_effect.node_without_effect(["camera_demo:=front"], "/front", ["/camera_demo"])
    assert found is not None and found.code == "rule-kind" and "-r __node:=front" in found.hint
    assert rule_effect.node_without_effect(["camera_demo:=rear"], "/front", ["/camera_demo"]) is None
    given = rule_effect.renames_nothing(["a:=1", "camera_name:=front"], "/front")
    assert given is not None and given.because.startswith("`-p camera_name:=front` gives a parameter")
    assert rule_effect.renames_nothing(["a:=1", "camera_name:=rear"], "/front") is None


def test_a_value_given_with_the_option_for_rules_leads_to_the_one_for_parameters() -> None:
    found, other = remap_rules.refused(["camera_rate:=40"]), remap_rules.refused(["camera:=2nd"])
    assert found is not None and "-p camera_rate:=40" in found.hint
    assert other is not None and "-p" not in other.hint


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("/a:\n  ros_parameters:\n    b: 1\n", 4, "not a `name: value` below `ros__parameters:`"),
        ("/a:\n  b: 1\n", 3, "not a `name: value` below `ros__parameters:`"),
        ("/a:\n  ros__parameters:\n    - b: 1\n    - c: 2\n", 5, "not a `name: value` below `ros__parameters:`"),
        ("/a:\n  ros__parameters: &x {b: 1}\n/c:\n  ros__parameters: *x\n", 5, "an anchor"),
        ("/a/:\n  ros__parameters:\n    b: 1\n", 0, "ends with a slash"),
        ("/a:\n  /a/c:\n    ros__parameters:\n      b: 1\n", 0, "which is not a node name"),
    ],
)
def test_a_parameter_file_that_rcl_refuses_is_explained(tmp_path: Path, text: str, line: int, words: str) -> None:
    (tmp_path / "car.yaml").write_text(text)
    with contextlib.chdir(tmp_path), pytest.raises(Exception, match="params file") as caught:
        rclpy.init(context=rclpy.Context(), args=["x", "--ros-args", "--params-file", "car.yaml"])
    found = params_file.why_refused(f"Traceback\nRCLError: {caught.value}", tmp_path)
    assert found is not None and words in found.because
    assert not line or f"line {line} of the cell" in found.because


def test_the_names_in_a_parameter_file_are_known_by_node() -> None:
    text = "/a/b:\n  ros__parameters: {x: 1, y: 2}\n/**:\n  ros__parameters: {z: 3}\n/c:\n  ros__parameters: {v: 4}\n"
    assert sorted(params_file.names_for(text, "/a/b")) == ["x", "y", "z"]


def test_an_absolute_name_in_the_code_is_told_from_a_wrong_rule() -> None:
    reason = rule_effect.without_effect(["camera:=image"], "/x/image", ["/x/demo"], ["/camera"])
    assert reason is not None
    assert reason.code == "absolute-name"


def test_a_rule_of_another_node_is_not_blamed_for_the_order() -> None:
    rules = ["front:camera:=a", "rear:camera:=image"]
    found = rule_effect.without_effect(rules, "/image", ["/rear"], {"/a": ["/front"], "/stop": ["/rear"]})
    assert found == RULE_WITHOUT_MATCH(
        "The rule `rear:camera:=image` changed nothing: nothing is called `/camera`, the name on its left side.",
        "Compare the left side with the name in the code, letter by letter. ROS 2 does not warn about such a rule.",
    )


@pytest.mark.parametrize(
    ("rules", "nodes", "used"),
    [
        (["~/status:=image"], ["/x/demo"], ["/status"]),
        (["camera_demo:__ns:=/left"], ["/x/demo"], ["/camera"]),
        (["~/camera:=image"], ["/demo"], ["/camera"]),
    ],
)
def test_a_private_name_or_an_idle_namespace_is_not_called_absolute(
    rules: list[str], nodes: list[str], used: list[str]
) -> None:
    wanted = "/x/image" if nodes == ["/x/demo"] else "/image"
    reason = rule_effect.without_effect(rules, wanted, nodes, used)
    assert reason is None or reason.code == "rule-without-match"


def test_rules_that_have_nothing_to_do_with_the_wanted_name_are_not_blamed() -> None:
    assert rule_effect.without_effect(["a:=b"], "/image", ["/camera_demo"], ["/camera"]) is None


@pytest.mark.parametrize(
    ("key", "reached"),
    [
        ("camera_demo", False),
        ("right_demo", False),
        ("/vehicle/camera_demo", False),
        ("/*", False),
        ("/vehicle/right_demo", True),
        ("vehicle/right_demo", True),
        ("/vehicle/*", True),
        ("/vehicle/**", True),
        ("/**/right_demo", True),
        ("/*/right_demo", True),
        ("/**", True),
    ],
)
def test_a_parameter_files_key_is_matched_as_rcl_does(tmp_path: Path, key: str, reached: bool) -> None:
    text = f"{key}:\n  ros__parameters:\n    rate: 40\n"
    (tmp_path / "p.yaml").write_text(text)
    words = ["-r", "__ns:=/vehicle", "-r", "__node:=right_demo", "--params-file", str(tmp_path / "p.yaml")]
    with started(*words) as node:
        assert (node.declare_parameter("rate", 10).value == 40) is reached
    assert (params_file.why_not_reached(text, "/vehicle/right_demo") is None) is reached


@pytest.mark.parametrize(("name", "text"), [("none.yaml", ""), ("/dev/none/p.yaml", ""), ("latin.yaml", "a: \ufffd")])
def test_a_parameter_file_that_cannot_be_read_as_text_stops_no_check(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / "latin.yaml").write_bytes(b"a: \xe4")
    assert params_file.text_of(tmp_path, name) == text


def test_nested_keys_of_a_parameter_file_are_joined() -> None:
    assert params_file.node_keys("vehicle:\n  right:\n    ros__parameters: {a: 1}\n/b:\n  ros__parameters: {}\n") == [
        "/vehicle/right",
        "/b",
    ]


@pytest.mark.parametrize(
    ("text", "read"),
    [
        ("/**:\n  ros__parameters:\n    p:\t5\n", True),
        ("/**:\n  ros__parameters:\n    p: 5\t# five\n", True),
        ("/**:\t\n  ros__parameters:\t# here\n    p: [5,\t6]\t\n", True),
        ("---\n/**:\n  ros__parameters:\n    p: 5\n---\n/**:\n  ros__parameters:\n    p: 6\n", True),
        ("/**:\n\tros__parameters:\n\t\tp: 5\n", False),
        ("/**:\n  ros__parameters:\n    p: a: b\n", False),
    ],
)
def test_only_a_parameter_file_that_rcl_does_not_read_either_is_called_unreadable(
    tmp_path: Path, text: str, read: bool
) -> None:
    (tmp_path / "p.yaml").write_text(text)
    words = ["--params-file", str(tmp_path / "p.yaml")]
    assert (params_file.unreadable(words, tmp_path) is None) is read
    context = rclpy.Context()
    with contextlib.nullcontext() if read else pytest.raises(Exception, match="parse params file"):
        rclpy.init(context=context, args=["x", "--ros-args", *words])
    rclpy.try_shutdown(context=context)


@pytest.mark.parametrize("name", ["__node", "__name", "__ns"])
def test_a_name_that_is_given_as_a_parameter_is_sent_to_the_right_option(name: str) -> None:
    reason = remap_rules.refused_parameter(["--ros-args", "-p", f"{name}:=front"])
    assert reason is not None
    assert reason.code == "rule-kind"
    assert f"-r {name}:=" in reason.hint


@pytest.mark.parametrize(
    ("key", "reached"),
    [("/**" * 200, True), ("/**" * 200 + "/x", False), ("/**/*" * 200, False), ("/*/**/**/*", True)],
)
def test_a_key_of_many_wildcards_is_matched_at_once(key: str, reached: bool) -> None:
    text = f"{key}:\n  ros__parameters:\n    rate: 40\n"
    assert (params_file.why_not_reached(text, "/vehicle/right_demo") is None) is reached


def test_a_parameter_file_that_grows_has_no_keys() -> None:
    tree = "a0: &a0 {x: 1}\n" + "".join(
        f"a{n}: &a{n} {{{', '.join(f'k{i}: *a{n - 1}' for i in range(9))}}}\n" for n in range(1, 9)
    )
    assert params_file.node_keys(tree) == []
    # rcl refuses the whole file, and that is what a student is told.
    assert params_file.node_keys("a: &a {ros__parameters: {b: 1}}\nc: {<<: *a}\n") == []


@pytest.mark.parametrize(
    "text",
    [
        "/a:\n  ros__parameters:\n    b: &x 1\n    c: &x 2\n",
        "/a:\n  ros__parameters:\n    b: 1\n    c: 1\n    b: 2\n",
        "/a:\n  ros__parameters:\n    b: 1\n---\n/a:\n  ros__parameters:\n    c: 2\n",
        "/a:\n  ros__parameters:\n    b:\t1\n    c: 2\n",
        "/a:\n  ros__parameters:\n    b: !car 1\n    c: !!python/name 2\n",
        "/a: !car\n  ros__parameters: !car\n    b: 1\n    c: 2020-13-45\n",
        "/a:\n  ros__parameters:\n    b: [1, 2]\n/a:\n  ros__parameters:\n    c: 2\n",
        "a:\n  ros__parameters:\n    b: {d: 1}\n    c: 2\n",
    ],
)
def test_a_parameter_file_that_rcl_reads_is_read_as_rcl_reads_it(tmp_path: Path, text: str) -> None:
    file = tmp_path / "a.yaml"
    file.write_text(text)
    context = rclpy.Context()
    rclpy.init(context=context, args=["x", "--ros-args", "--params-file", str(file)])
    node = Node("a", context=context, automatically_declare_parameters_from_overrides=True)
    try:
        given = {name.partition(".")[0] for name in node.get_parameters_by_prefix("") if name[0] in "bc"}
    finally:
        node.destroy_node()
        rclpy.try_shutdown(context=context)
    assert params_file.unreadable(["--params-file", "a.yaml"], tmp_path) is None
    assert given == set(params_file.names_for(text, "/a")) == {"b", "c"}
    reason = params_file.why_not_reached(text, "/other")
    assert reason is not None and "`/a`" in reason


@pytest.mark.parametrize(
    ("rule", "wanted", "nodes", "says"),
    [
        ("rigth_eye:__node:=starboard_eye", "/starboard_eye", ["/port_eye", "/right_eye"], "`rigth_eye` in its code"),
        ("port_eye:__node:=left_eye", "/port_eye", ["/left_eye", "/right_eye"], "gives the node `port_eye` the name"),
        ("old:__ns:=/rear", "/rear/new", ["/new"], "a node named `old`"),
        ("left_eye:__node:=port_eye", "/starboard_eye", ["/port_eye", "/right_eye"], ""),
        ("right_eye:__node:=starboard_eye", "/area/starboard_eye", ["/starboard_eye"], ""),
        ("new:__ns:=/rear", "/rear/other", ["/rear/new"], ""),
    ],
)
def test_a_rule_for_one_node_that_matched_nothing_is_named(rule: str, wanted: str, nodes: list[str], says: str) -> None:
    reason = rule_effect.node_without_effect([rule], wanted, nodes)
    assert bool(reason) == bool(says)
    assert reason is None or says in reason.because
