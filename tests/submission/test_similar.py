"""Submissions that are alike: renaming and reformatting hide nothing, and what everybody has accuses nobody."""

from __future__ import annotations

from autograder.submission.similar import similar

GIVEN = {
    "talker": "%%node talker\nimport rclpy\nfrom rclpy.node import Node\n\n# YOUR CODE HERE",
    "why": "YOUR ANSWER HERE",
}
TALKER = """%%node talker
import rclpy
from rclpy.node import Node


class Talker(Node):
    def __init__(self):
        super().__init__("talker")
        self.count = 0  # how often it has spoken
        self.publisher = self.create_publisher(String, "chatter", 10)
        self.timer = self.create_timer(0.5, self.speak)

    def speak(self):
        message = String()
        message.data = f"hello {self.count}"
        if self.count % 3 == 0 and self.count > 6:
            self.get_logger().info("every third one is special, is it not")
        self.publisher.publish(message)
        self.count += 1
"""
COPIED = (
    TALKER.replace("Talker", "Voice").replace("speak", "shout").replace("message", "m").replace("count", "n")
    .replace("\n\n    def", "\n    # a comment of my own\n    def")
)  # fmt: skip
OWN = """%%node talker
import rclpy
from rclpy.node import Node

numbers = itertools.count()
node = rclpy.create_node("talker")
chatter = node.create_publisher(String, "chatter", qos_profile=QoSProfile(depth=5))
while rclpy.ok():
    chatter.publish(String(data="hello " + str(next(numbers))))
    for _ in range(5):
        rclpy.spin_once(node, timeout_sec=0.1)
try:
    node.destroy_node()
finally:
    rclpy.shutdown()
"""


def found(**talkers: str) -> dict[tuple[str, str], float]:
    submissions = {student: {"talker": text, "why": "Because."} for student, text in talkers.items()}
    return {pair.students: pair.likeness for pair in similar(submissions, GIVEN, 0.5)}


def test_a_copy_with_other_names_is_found_and_an_own_program_is_not() -> None:
    pairs = found(ann=TALKER, bob=COPIED, cem=OWN, dan=GIVEN["talker"])
    assert set(pairs) == {("ann", "bob")} and pairs["ann", "bob"] > 0.9


def test_what_many_have_is_common_knowledge() -> None:
    everybody = {f"s{number}": TALKER for number in range(12)}
    assert found(**everybody, cem=OWN) == {}
    assert found(**{f"s{number}": GIVEN["talker"] for number in range(4)}) == {}


def test_lines_that_only_two_have_are_shown_also_of_answers_in_words() -> None:
    words = "The two timers share one group, " * 3 + "so the second waits until the first has come back from its nap."
    submissions = {
        "ann": {"talker": TALKER, "why": words},
        "bob": {"talker": OWN, "why": f"{words}\n{words}"},
        "cem": {"talker": "%%node talker\ndef (", "why": "Groups exclude each other."},
    }
    (pair,) = similar(submissions, GIVEN, 0.05)
    assert pair.students == ("ann", "bob") and pair.answers[0] == "why" and " ".join(words.split()) in pair.lines
