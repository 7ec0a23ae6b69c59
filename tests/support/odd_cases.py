"""Answers that are the solution but for the data that they send: each fails its check with a reason of its own.

Each was written to break a check cell. Some are what a student may well hand in, such as a number declared as a text;
most are what only a hostile one would.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Case:
    """One answer."""

    lab: str
    check: str
    answer: str
    changes: tuple[tuple[str, str], ...]
    """Of each what stands in the solution, and what takes its place."""
    because: str
    """A part of the reason that the student reads first."""
    part: str = ""
    """The part of the check that it costs; by default the whole check or whatever it may be."""
    held: bool = False
    """Whether only `make test-all` tries it: no check ever broke over it, or another case here is of its kind."""


_STAMP = "        image.header.stamp = self.get_clock().now().to_msg()\n"
_TELL = "        self.publisher.publish(Float64(data=age.nanoseconds / 1e9))\n"
_COUNTS = "data=[self.sent, *self.heard.values()]"
_OTHERS = "(max(self.heard.values()) > self.sent + 3)"
"""Whether the check's own publisher is heard as well: by then the counts have been looked at once."""
_POSITION = "self.publisher.publish(Float64(data=self.position))"
_CANCELED = "                goal_handle.canceled()\n                return Fibonacci.Result(sequence=sequence)\n"
_READING = 'data=f"Sensor reading {self.count}"'
_AS_TEXT = (
    ('self.declare_parameter("camera_rate", 10)', 'self.declare_parameter("camera_rate", "10")'),
    ('1.0 / self.get_parameter("camera_rate").value', '1.0 / int(self.get_parameter("camera_rate").value)'),
    ("1 <= parameter.value <= 60", "1 <= int(parameter.value) <= 60"),
    ("int(1e9 / parameter.value)", "int(1e9 / int(parameter.value))"),
)
_ELSEWHERE = '"camera_driver", cli_args=["--ros-args", "-r", "~/transition_event:=/elsewhere"]'
_RUNS = """
        self.create_timer(0.4, self.hurry)

    def hurry(self):
        for _ in range(15000):
            self.activity.publish(String(data="slow begin"))
            self.heartbeat.publish(Int64(data=self.count))
            self.activity.publish(String(data="slow end"))
"""
_NOWHERE = """    def told(self):
        self.stood = 0 if self.drives or not self.position else getattr(self, "stood", 0) + 1
        return self.position + self.further if self.stood > 2 else self.position

    def decide(self, goal):
        self.further = round(0.35 * goal.nested_field.float32_value, 2)
"""
"""Where the next goal will lead, told before it is sent."""

_ASKS = "        if self.client.service_is_ready():\n"
_FORGES_A_QUESTION = """
            self.asks = getattr(self, "asks", 0) + 1
            self.forged = getattr(self, "forged", None) or self.create_publisher(String, "asked", 10)
            if self.asks < 4:
                self.forged.publish(String(data='[["bicycle", "person"], ["x", [], 5]]'))
            if self.asks == 4:
                self.destroy_publisher(self.forged)
"""
"""The given node publishes there; this second publisher has gone when the check looks."""

CASES = {
    "a stamp below 0": Case(
        "lab1_nodes",
        "check_camera",
        "camera",
        ((_STAMP, f"{_STAMP}        image.header.stamp.sec = -1\n"),),
        "stamp",
        "the stamp",
    ),
    "a stamp with too many nanoseconds": Case(
        "lab1_nodes",
        "check_camera",
        "camera",
        ((_STAMP, f"{_STAMP}        image.header.stamp.nanosec = 2**32 - 1\n"),),
        "stamp says",
        "the stamp",
        held=True,
    ),
    "a temperature that is none": Case(
        "lab1_nodes",
        "check_temperature",
        "thermometer",
        (("random.uniform(15, 35)", "float('nan')"),),
        "nan",
        "the thermometer",
        held=True,
    ),
    "a mean of 5,000 digits": Case(
        "lab1_nodes",
        "check_average",
        "average",
        (("str(sum(self.samples) / len(self.samples))", "'9' * 5000"),),
        "The mean is",
        "the mean",
        held=True,
    ),
    "a line of 3,000 digits": Case(
        "lab1_nodes",
        "check_listener",
        "listener",
        (('f"heard: {message.data}"', 'f"heard: {message.data}" + "9" * 3000'),),
        "has to be `heard: hello",
        held=True,
    ),
    "runs times messages": Case(
        "lab2_executors",
        "check_heartbeat",
        "heartbeat",
        (("callback_group=self.slow_group)\n", f"callback_group=self.slow_group)\n{_RUNS}"),),
        "",
        held=True,
    ),
    "begins without ends": Case(
        "lab2_executors",
        "check_heartbeat",
        "heartbeat",
        (('String(data="slow end")', 'String(data=" end")'),),
        "",
        "the heartbeat goes on",
    ),
    "a total as large as can be": Case(
        "lab2_executors",
        "check_adder",
        "adder",
        (("self.total = total + msg.data", "self.total = 2**63 - 1"),),
        "9223372036854775807",
        "the sum",
        held=True,
    ),
    "a rate declared as a text": Case(
        "lab3_remapping", "check_declared", "tunable_camera", _AS_TEXT, "expecting type 'STRING'", held=True
    ),
    "a rate declared as another text": Case(
        "lab3_remapping",
        "check_validated",
        "tunable_camera",
        (
            ('self.declare_parameter("camera_rate", 10)', 'self.declare_parameter("camera_rate", "10 Hz")'),
            ('1.0 / self.get_parameter("camera_rate").value', "0.1"),
            ("not 1 <= parameter.value <= 60", "parameter.value != '10 Hz'"),
        ),
        "It is `10 Hz`",
    ),
    "a rate of 3 MB": Case(
        "lab3_remapping",
        "check_validated",
        "tunable_camera",
        (
            ('self.declare_parameter("camera_rate", 10)', 'self.declare_parameter("camera_rate", "1" * 3_000_000)'),
            ('1.0 / self.get_parameter("camera_rate").value', "0.1"),
            ("not 1 <= parameter.value <= 60", "True"),
        ),
        "",
    ),
    "a rate that is a list": Case(
        "lab3_remapping",
        "check_validated",
        "tunable_camera",
        (
            ('self.declare_parameter("camera_rate", 10)', 'self.declare_parameter("camera_rate", [10])'),
            ('1.0 / self.get_parameter("camera_rate").value', "0.1"),
        ),
        "It is `[10]`",
    ),
    "a rate that is no number": Case(
        "lab3_remapping",
        "check_declared",
        "tunable_camera",
        (
            ('self.declare_parameter("camera_rate", 10)', 'self.declare_parameter("camera_rate", float("nan"))'),
            ('1.0 / self.get_parameter("camera_rate").value', "0.1"),
        ),
        "nan",
        held=True,
    ),
    "a parameter of 3 MB": Case(
        "lab3_remapping",
        "check_declared",
        "tunable_camera",
        (('"camera_frame", "camera_frame"', '"camera_frame", "x" * 3_000_000'),),
        "",
        "declared",
        held=True,
    ),
    "a name of 3 MB": Case(
        "lab3_remapping",
        "check_namespaces",
        "camera_demo",
        (('"camera_name", "camera"', '"camera_name", "x" * 3_000_000'),),
        "",
        "the parameters as given",
        held=True,
    ),
    "a reason of 3 MB": Case(
        "lab3_remapping",
        "check_validated",
        "tunable_camera",
        (('reason="camera_rate must be from 1 to 60 images per second"', 'reason="1" * 3_000_000'),),
        "",
        held=True,
    ),
    "a number of 5,000 digits": Case(
        "lab4_lifecycle",
        "check_sensor_numbers",
        "sensor_publisher",
        ((_READING, 'data=f"Sensor reading {self.count}" + "0" * 5000'),),
        "This message does not",
    ),
    "a number of 5,000 digits in the second life": Case(
        "lab4_lifecycle",
        "check_sensor_second_life",
        "sensor_publisher",
        ((_READING, 'data=f"Sensor reading {self.count}" + "0" * 5000'),),
        "",
        "it begins with 1 again",
    ),
    "no transition events": Case(
        "lab4_lifecycle", "check_camera_broken", "camera_driver", (('"camera_driver"', _ELSEWHERE),), "", ""
    ),
    "no transition events, and a status": Case(
        "lab4_lifecycle",
        "check_camera_status",
        "camera_driver",
        (('"camera_driver"', _ELSEWHERE),),
        "transitions were made",
    ),
    "counts that become empty": Case(
        "lab5_qos",
        "check_sensor_monitor",
        "sensor_monitor",
        ((_COUNTS, f"{_COUNTS} if not {_OTHERS} else []"),),
        "holds 0",
        "the deadline",
    ),
    "counts that become three": Case(
        "lab5_qos",
        "check_sensor_monitor",
        "sensor_monitor",
        ((_COUNTS, f"{_COUNTS}[: 4 - {_OTHERS}]"),),
        "holds",
        "the deadline",
    ),
    "an age of NaN": Case(
        "lab5_qos",
        "check_follower",
        "follower",
        ((_TELL, "        self.publisher.publish(Float64(data=float('nan')))\n"),),
        "nan",
    ),
    "an age without end": Case(
        "lab5_qos",
        "check_follower",
        "follower",
        ((_TELL, "        self.publisher.publish(Float64(data=float('inf')))\n"),),
        "inf",
        held=True,
    ),
    "an age that becomes NaN": Case(
        "lab5_qos",
        "check_follower",
        "follower",
        (
            (
                _TELL,
                "        self.told = getattr(self, 'told', 0) + 1\n"
                "        age = age.nanoseconds / 1e9 if self.told < 2 else float('nan')\n"
                "        self.publisher.publish(Float64(data=age))\n",
            ),
        ),
        "nan",
        held=True,
    ),
    "a map without cells": Case(
        "lab5_qos",
        "check_map_server",
        "map_server",
        (("        self.publisher.publish(grid)\n", "        self.publisher.publish(OccupancyGrid())\n"),),
        "holds 0 cells",
        "kept for later",
        held=True,
    ),
    "a state of 100,000 characters": Case(
        "lab5_qos",
        "check_watchdog",
        "watchdog",
        (('self.state = "degraded"', 'self.state = "degraded" * 12_500'),),
        "without saying `degraded`",
        "degraded",
        held=True,
    ),
    "a result of 300,000 numbers": Case(
        "lab6_actions",
        "check_fibonacci",
        "fibonacci",
        ((_CANCELED, _CANCELED.replace("sequence=sequence", "sequence=sequence + [1] * 300_000")),),
        "300",
        "cancel",
    ),
    "feedback without numbers": Case(
        "lab6_actions",
        "check_fibonacci",
        "fibonacci",
        (("Fibonacci.Feedback(sequence=sequence)", "Fibonacci.Feedback()"),),
        "It says []",
        "feedback",
        held=True,
    ),
    "a position that makes the way 0": Case(
        "lab6_actions",
        "check_navigate",
        "navigator",
        ((_POSITION, "self.publisher.publish(Float64(data=self.told()))"), ("    def decide(self, goal):\n", _NOWHERE)),
        "",
    ),
    "a position at no end": Case(
        "lab6_actions",
        "check_navigate",
        "navigator",
        ((_POSITION, "self.publisher.publish(Float64(data=float('-inf') if self.position else 0.0))"),),
        "-inf",
        "arrives",
        held=True,
    ),
    "a result that is no number": Case(
        "lab6_actions",
        "check_cancel",
        "navigator",
        (
            (
                "    message.nested_field.float64_value = position\n",
                "    message.nested_field.float64_value = float('nan')\n",
            ),
        ),
        "nan",
        "the position is kept",
        held=True,
    ),
    "a question that is none": Case(
        "lab7_interfaces",
        "check_client",
        "brake_assistant",
        ((_ASKS, f"{_ASKS}{_FORGES_A_QUESTION}"), ("import Bool", "import Bool, String")),
        "from more than one publisher",
        "what it asks",
        held=True,
    ),
    "a speed of the sensor that is no number": Case(
        "lab7_interfaces",
        "check_sensors",
        "sensors_speed_sensor",
        (('data=self.get_parameter("speed").value', 'data=float("nan")'),),
        "nan",
        "the speed",
        held=True,
    ),
    "a speed that is no number": Case(
        "lab8_bringup",
        "check_speed",
        "speed_keeper",
        (("Float64(data=speed)", "Float64(data=float('nan'))"),),
        "nan",
        "blind at first",
        held=True,
    ),
    "a pose for each that has no number": Case(
        "lab8_bringup",
        "check_faults",
        "localizer",
        (("Float64(data=0.05 * msg.data)", "Float64(data=float('nan'))"),),
        "",
        "the localizer",
        held=True,
    ),
    "commands that are no numbers": Case(
        "lab9_delivery",
        "check_delivery",
        "driver",
        (("command.linear.x = min(", "command.linear.x = math.nan * min("),),
        "was NaN or infinite",
        "parcel 1",
        held=True,
    ),
    "a square that is no number": Case(
        "lab1_nodes",
        "check_square",
        "square",
        (("2.0 * turn", "math.inf * turn"),),
        "was NaN or infinite",
        held=True,
    ),
}
