%%node car_manager
import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import String


class CarManager(Node):
    """Nothing waits: a timer looks at what has been answered, and takes up the next node."""

    def __init__(self):
        super().__init__("car_manager")
        self.declare_parameter("layers", ["lidar"])
        self.declare_parameter("optional", ["camera"])
        self.declare_parameter("patience", 1.0)
        self.car_state = self.create_publisher(String, "car_state", 10)
        self.rounds = self.work()
        next(self.rounds)
        self.create_timer(0.02, lambda: next(self.rounds))

    def seconds(self):
        return self.get_clock().now().nanoseconds / 1e9

    def ask(self, kind, name, request):
        client = self.proxies.setdefault((kind, name), None) or self.create_client(
            kind, f"{name}/{'get_state' if kind is GetState else 'change_state'}")
        self.proxies[kind, name] = client
        until = self.seconds() + self.get_parameter("patience").value
        while not client.service_is_ready():
            if self.seconds() > until:
                return None
            yield
        future = client.call_async(request)
        until = self.seconds() + self.get_parameter("patience").value
        while not future.done():
            if self.seconds() > until:
                client.remove_pending_request(future)
                return None
            yield
        return future.result()

    def work(self):
        self.proxies = {}
        optional = self.get_parameter("optional").value
        while True:
            state = "running"
            for layer in self.get_parameter("layers").value:
                for name in layer.split():
                    active = yield from self.bring_up(name)
                    if not active and state != "waiting":
                        state = "degraded" if name in optional else "waiting"
                if state == "waiting":
                    break
            self.car_state.publish(String(data=state))
            for _ in range(10):
                yield

    def bring_up(self, name):
        for label, goal in (("configure", "unconfigured"), ("activate", "inactive")):
            answer = yield from self.ask(GetState, name, GetState.Request())
            if answer is None:
                return False
            if answer.current_state.label == goal:
                change = ChangeState.Request(transition=Transition(label=label))
                done = yield from self.ask(ChangeState, name, change)
                if done is None or not done.success:
                    return False
        answer = yield from self.ask(GetState, name, GetState.Request())
        return answer is not None and answer.current_state.label == "active"


def main():
    rclpy.init()
    try:
        rclpy.spin(CarManager())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
