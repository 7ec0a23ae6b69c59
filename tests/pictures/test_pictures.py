"""Pictures: what they show and say, that nothing in them can act, and where they stand: notebook, report, feedback."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

import pytest
from std_msgs.msg import String

from autograder.checks import current, launch
from autograder.core.results import CellResult, Isolation, Outcome, Status
from autograder.pictures import (
    Endpoint,
    Picture,
    Run,
    Runs,
    Traffic,
    arrivals,
    graph,
    lifecycle,
    qos,
    steps,
    timeline,
)  # fmt: skip
from autograder.report.html import check_html

NASTY = "<script>alert(1)</script>\x00\ud800\"'&"
BEATS = [Run("beat", 0.1 * n, 0.1 * n + 0.005, 1, "exclusive group") for n in range(5)]
SLOW = [Run("slow", 0.05, 0.35, 2, "default group (exclusive)"), Run("slow", 0.3, 0.5, 3, "default group (exclusive)")]
RELIABLE = {"reliability": "reliable", "durability": "volatile", "deadline": 0.05}
BEST_EFFORT = {"reliability": "best_effort", "durability": "volatile", "deadline": None}
ENDS = [
    Endpoint("/camera", "/frames", True, BEST_EFFORT),
    Endpoint("/planner", "/frames", False, RELIABLE),
    Endpoint("/viewer", "/frames", False, BEST_EFFORT),
]
CHANGES = [
    ("unconfigured", "configuring"), ("configuring", "inactive"),
    ("inactive", "activating"), ("activating", "errorprocessing"), ("errorprocessing", "unconfigured"),
    ("unconfigured", "configuring"), ("configuring", "unconfigured"),
]  # fmt: skip


def mismatch(offer: Endpoint, request: Endpoint) -> str | None:
    stricter = request.policies["reliability"] == "reliable" != offer.policies["reliability"]
    return "reliability" if stricter else None


def words(picture: Picture) -> str:
    """The texts of a drawing, which must be well-formed and hold nothing but shapes and words."""
    tree = ET.fromstring(picture.svg)
    tags = {element.tag.partition("}")[2] for element in tree.iter()}
    assert tags <= {"svg", "style", "defs", "pattern", "marker", "path", "rect", "ellipse", "circle", "text"}
    (style,) = (element.text or "" for element in tree.iter() if element.tag.endswith("style"))
    assert style.startswith("@media (prefers-color-scheme:dark){") and "url" not in style
    assert "href" not in picture.svg
    return " | ".join(element.text or "" for element in tree.iter() if element.tag.endswith("text"))


def test_runs_tell_what_was_under_way_when() -> None:
    runs = Runs(BEATS + SLOW)
    assert runs.callbacks() == ["beat", "slow"]
    assert (runs.count("beat"), runs.count()) == (5, 7)
    assert (runs.overlap("beat"), runs.overlap("slow"), runs.overlap()) == (1, 2, 3)
    assert runs.longest_pause("beat") == pytest.approx(0.1) and runs.longest_pause("nobody") == float("inf")
    assert runs.longest("slow") == pytest.approx(0.3) and runs.threads("slow") == {2, 3}
    assert Runs([]).overlap() == 0 and repr(Runs([])) == "runs of callbacks: none"
    # What begins when another ends does not overlap it.
    assert Runs([Run("a", 0, 1), Run("a", 1, 2)]).overlap() == 1


def test_a_timeline_has_rows_by_group_and_names_the_threads() -> None:
    picture = timeline({"two threads": Runs(BEATS + SLOW), "none": Runs([])})
    shown = words(picture)
    for text in ("two threads", "exclusive group", "default group (exclusive)", "beat", "threads 2, 3", "no callback"):
        assert text in shown
    assert "slow ran 2 times, each for at most 0.30 seconds, on threads 2, 3; at most 3 at once" in picture.alt
    assert "slow ran once for at most 0.30 seconds, on thread 2;" in timeline(Runs(SLOW[:1])).alt
    assert "url(#h1)" in picture.svg  # a hatching beside the colour


def test_a_timeline_by_thread_has_a_row_for_each_thread() -> None:
    assert "thread 1 | thread 2 | thread 3" in words(timeline(Runs(BEATS + SLOW), by="thread"))
    with pytest.raises(ValueError, match="by='group'"):
        timeline(Runs(BEATS), by="group")


def test_every_row_of_a_timeline_has_a_name_and_its_node() -> None:
    runs = Runs([
        Run("beat", 0, 0.1, 1, "reentrant group", "/robot", program="both"),
        Run("show", 0.1, 0.9, 2, "default group (exclusive)", "/viewer", program="both"),
        Run("camera", 0.2, 0.3, 1, "default group (exclusive)", "/robot", program="both"),
        Run("beat", 0.4, 0.5, 1, "default group (exclusive)", "/viewer", False, program="both"),
    ])  # fmt: skip
    shown = words(timeline(runs)).split(" | ")
    rows = [text for text in shown if text in ("node /robot", "node /viewer", "beat", "camera", "show")]
    assert rows == ["node /robot", "beat", "camera", "node /viewer", "show", "beat"]
    assert {"one run of a callback", "the thread on which it ran", "still running when the picture was made"} <= set(
        shown
    )
    assert "beat of /robot ran once" in timeline(runs).alt and "beat of /viewer ran once" in timeline(runs).alt
    assert {"beat of /robot", "beat of /viewer", "camera", "show"} <= set(
        words(timeline(runs, by="thread")).split(" | ")
    )


def test_threads_of_two_programs_are_not_mixed() -> None:
    runs = Runs([Run("a", 0, 1, 1, node="/a", program="one"), Run("b", 0, 1, 1, node="/b", program="two")])
    shown = words(timeline(runs, by="thread")).split(" | ")
    assert [text for text in shown if text.startswith(("program", "thread"))] == [
        "program one", "thread 1", "program two", "thread 1",
    ]  # fmt: skip


def test_a_key_that_is_too_long_takes_several_lines() -> None:
    runs = Runs(Run(f"callback_number_{n}_of_the_robot", n, n + 1, 1) for n in range(6))
    picture = timeline(runs, seconds=8, by="thread")
    for text in re.findall(r'<text x="([\d.]+)"[^>]*text-anchor="start"', picture.svg):
        assert float(text) < 880


def test_an_action_is_one_thing_between_its_client_and_its_server() -> None:
    ends = [Endpoint("/dock", "/count", True, action=True), Endpoint("/planner", "/count", False, action=True)]
    drawn = graph(["/dock", "/planner"], ends, mismatch)
    assert {"action", "/count", "client", "server"} <= set(words(drawn).split(" | "))
    assert drawn.alt.endswith("/dock is the server of the action /count. /planner is a client of the action /count.")


def test_long_names_stay_apart() -> None:
    names = ["/front_left_camera_publisher_of_the_robot", "/front_right_camera_publisher_of_the_robot"]
    ends = [Endpoint(name, "/frames", False, BEST_EFFORT) for name in names]
    for picture in (graph(names, ends), qos("/frames", [ENDS[0], *ends], mismatch)):
        shown = words(picture)
        assert "left_" in shown and "right_" in shown
    many = qos(
        "/frames", [ENDS[0], *(Endpoint(f"/viewer_{n}", "/frames", False, RELIABLE) for n in range(9))], mismatch
    )
    assert "S9" in words(many) and "/viewer_8: reliable" in words(many)


def test_a_pair_that_does_not_match_shows_both_values_of_the_policy() -> None:
    shown = words(qos("/frames", ENDS, mismatch)).split(" | ")
    assert {"✗ reliability", "offers best effort", "asks reliable"} <= set(shown)
    assert "(it offers best effort, and reliable is requested)" in qos("/frames", ENDS, mismatch).alt


def test_a_graph_and_a_table_of_pairs_cross_out_what_does_not_match() -> None:
    drawn = graph(["/camera", "/lonely"], ENDS, mismatch)
    assert {"✗", "/lonely", "/frames", "best effort", "deadline 0.05 s"} <= set(words(drawn).split(" | "))
    assert "/planner subscribes to /frames (reliable, deadline 0.05 s), no match: reliability." in drawn.alt
    pairs = qos("/frames", ENDS, mismatch)
    assert words(pairs).count("✗") == words(pairs).count("✓") == 1
    lonely = qos("/frames", ENDS[:1], mismatch)
    assert "there is no subscription" in words(lonely) and lonely.alt.endswith("There is no subscription.")
    assert "no node is on the graph" in words(graph([], []))
    assert drawn.alt.startswith("Graph of 4 nodes: /camera, /lonely, /planner, /viewer.")
    assert graph(["/camera"], []).alt.startswith("Graph of 1 node: /camera.")


def test_nodes_in_a_circle_can_be_drawn() -> None:
    ends = [Endpoint(node, topic, publishes, RELIABLE) for node, topic, publishes in
            (("/a", "/x", True), ("/b", "/x", False), ("/b", "/y", True), ("/a", "/y", False))]  # fmt: skip
    assert {"/a", "/b", "/x", "/y"} <= set(words(graph(["/a", "/b"], ends)).split(" | "))


def test_a_way_through_the_states_is_numbered() -> None:
    way = steps(CHANGES)
    assert [(step.label, step.goal, step.failed) for step in way] == [
        ("configure", "inactive", False), ("activate", "unconfigured", True), ("configure", "unconfigured", True),
    ]  # fmt: skip
    picture = lifecycle("/camera", way)
    assert "2 activate: error, back in unconfigured" in " ".join(words(picture).split())
    assert "3 configure: failure, still unconfigured" in " ".join(picture.alt.split())
    assert "No change of /camera was heard" in lifecycle("/camera", []).alt


def test_arrivals_count_each_row() -> None:
    picture = arrivals(
        "/frames", [Traffic("/camera publishes", [0.0, 0.1, 0.2], 0.0), Traffic("/viewer takes", [0.21])]
    )
    assert "3 messages" in words(picture) and "1 message" in words(picture)
    assert "usually every 0.10 s" in picture.alt


def test_very_many_arrivals_are_thinned_out_and_the_picture_says_so() -> None:
    times = [0.001 * n for n in range(5000) if not 2000 <= n < 2500]
    picture = arrivals("/scan", [Traffic("/lidar publishes", times, 0.0, 9000)])
    strokes = picture.svg.count('stroke-width="2.6"')
    assert 50 < strokes < 150 and f"{strokes} of 4500 messages are drawn" in words(picture)
    assert "the first 4500 of 9000 messages" in words(picture) and f"{strokes} of 4500 messages" in picture.alt
    assert "are drawn" not in words(arrivals("/scan", [Traffic("/lidar publishes", times[:3000:300])]))


@pytest.mark.parametrize("seconds", [0.02, 3.0, 7200.0, 1e6])
def test_an_axis_of_seconds_fits_what_took_moments_and_what_took_days(seconds: float) -> None:
    shown = words(arrivals("/frames", [Traffic("/camera publishes", [0.0, seconds])])).split(" | ")
    assert 2 <= len([text for text in shown if re.fullmatch(r"[\d.]+( s)?", text)]) <= 20


def test_a_forged_name_does_nothing() -> None:
    ends = [Endpoint(NASTY, NASTY, True, BEST_EFFORT)]
    drawn = [
        timeline(Runs([Run(NASTY, 0, 1, group=NASTY, node=NASTY)])),
        graph([NASTY], ends),
        qos(NASTY, ends, mismatch),
        arrivals(NASTY, [Traffic(NASTY, [1.0])]),
        lifecycle(NASTY, []),
    ]
    inert = re.compile(r'<img alt="[^"<>]*" src="data:image/svg\+xml;base64,[\w+/=]*" style="[^"<>]*">')
    for picture in drawn:
        words(picture)
        assert inert.fullmatch(picture.html())
        picture.model_dump_json()


TWO_TIMERS = """
import time
import rclpy
from rclpy.node import Node
from std_msgs.msg import String

class Robot(Node):
    def __init__(self):
        super().__init__("robot")
        self.activity = self.create_publisher(String, "activity", 10)
        self.create_timer(0.1, self.beat)
        self.create_timer(0.2, self.camera)

    def beat(self):
        self.tell("beat", 0.0)

    def camera(self):
        self.tell("camera", 0.15)

    def tell(self, name, seconds):
        self.activity.publish(String(data=f"{name} begin"))
        time.sleep(seconds)
        self.activity.publish(String(data=f"{name} end"))

rclpy.init()
rclpy.spin(Robot())
"""


@pytest.fixture
def programs(tmp_path: Path) -> Iterator[Path]:
    """A folder with a program; what a check finds is forgotten at the end."""
    (tmp_path / "robot.py").write_text(TWO_TIMERS)
    current.check.configure(tmp_path, Isolation.NONE, seed=1)
    current.check.findings.reset()
    yield tmp_path
    current.check.findings.reset()
    current.check.close()
    current.check.__init__()  # type: ignore[misc]


def test_a_launch_draws_what_its_programs_did(programs: Path) -> None:
    with launch("robot") as ros:
        ros.topic("/activity", String).expect_publisher(node="/robot")
        assert ros.wait(lambda: ros.runs().count("camera") >= 2 and ros.runs().count("beat") >= 2, 60)
        on_graph = ros.draw.graph()
    runs = ros.runs()
    assert runs.overlap() == 1 and runs.threads() == {1} and runs.longest("camera") > 0.1
    assert {run.group for run in runs} == {"default group (exclusive)"} and {run.node for run in runs} == {"/robot"}
    assert "/robot publishes on /activity (reliable)." in on_graph.alt
    assert "camera ran" in ros.draw.timeline().alt and "/robot publishes" in ros.draw.arrivals("/activity").alt


def test_a_failed_check_shows_the_picture_that_explains_it(programs: Path) -> None:
    with launch("robot") as ros:
        assert ros.wait(lambda: ros.runs().count("camera") >= 2 and ros.runs().count("beat") >= 2, 60)
        ros.activity("/activity").expect_overlap(["beat", "camera"])
    shown = ros.score(1).result
    failure = shown.first_failure
    assert failure and failure.code == "single-threaded-executor" and failure.picture
    assert "at most 1 at once" in failure.picture.alt
    assert failure.picture.html() in check_html(shown)


def test_a_hidden_check_shows_a_student_no_picture() -> None:
    failed = Outcome(status=Status.FAILED, title="t", picture=timeline(Runs(BEATS)), hidden=True)
    result = CellResult(max_points=1, points=0, outcomes=[failed])
    assert "<img" not in check_html(result, "student") and "<img" in check_html(result, "instructor")


def test_a_picture_of_what_holds_says_what_it_shows() -> None:
    titles = ["The car reaches shop", "The car reaches park"]
    pictures = [timeline(Runs(BEATS)), timeline(Runs(BEATS[1:]))]
    outcomes = [
        Outcome(status=Status.PASSED, title=one, picture=shown) for one, shown in zip(titles, pictures, strict=True)
    ]
    shown = check_html(CellResult(max_points=1, points=1, outcomes=outcomes))
    assert re.findall(r"A picture of your run: (.*?)</summary>", shown) == titles
