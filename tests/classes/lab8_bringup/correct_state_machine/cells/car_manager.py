%%node car_manager
from dataclasses import dataclass

import rclpy
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String


@dataclass
class Member:
    """What is known of a node; a question that is under way has a deadline."""

    name: str
    get: object
    change: object
    state: int = State.PRIMARY_STATE_UNKNOWN
    asked: object = None
    until: float = 0.0
    kind: str = ""


class CarManager(Node):
    """Every tenth of a second: collect answers, give up late ones, and ask the next question of each node."""

    def __init__(self):
        super().__init__("car_manager")
        layers = self.declare_parameter("layers", ["lidar"]).value
        self.optional = self.declare_parameter("optional", ["camera"]).value
        self.patience = self.declare_parameter("patience", 1.0).value
        self.layers = [[self.member(name) for name in text.split()] for text in layers]
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.car_state = self.create_publisher(String, "car_state", latched)
        self.create_timer(0.1, self.look)
        self.ticks = 0

    def member(self, name):
        return Member(name, self.create_client(GetState, name + "/get_state"),
                      self.create_client(ChangeState, name + "/change_state"))

    def now(self):
        return self.get_clock().now().nanoseconds * 1e-9

    def ask(self, one, kind, request):
        client = one.get if kind == "state" else one.change
        if client.service_is_ready():
            one.kind, one.asked, one.until = kind, client.call_async(request), self.now() + self.patience
        else:
            one.state = State.PRIMARY_STATE_UNKNOWN

    def step(self, one, may_act):
        if one.asked is not None:
            if one.asked.done():
                answer, one.asked = one.asked.result(), None
                if one.kind == "state":
                    one.state = answer.current_state.id
                    label = {State.PRIMARY_STATE_UNCONFIGURED: "configure", State.PRIMARY_STATE_INACTIVE: "activate"}.get(one.state)
                    if label and may_act:
                        self.ask(one, "change", ChangeState.Request(transition=Transition(label=label)))
            elif self.now() > one.until:
                one.asked, one.state = None, State.PRIMARY_STATE_UNKNOWN
        else:
            self.ask(one, "state", GetState.Request())

    def look(self):
        before, verdict = True, "running"
        for layer in self.layers:
            for one in layer:
                self.step(one, before)
            for one in layer:
                if one.state != State.PRIMARY_STATE_ACTIVE:
                    if one.name not in self.optional:
                        before, verdict = False, "waiting"
                    elif verdict == "running":
                        verdict = "degraded"
        self.ticks += 1
        if self.ticks % 5 == 0:
            self.car_state.publish(String(data=verdict))


def main():
    rclpy.init()
    try:
        rclpy.spin(CarManager())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
