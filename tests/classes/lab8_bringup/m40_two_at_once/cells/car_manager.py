%%node car_manager
import time

import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import String


class CarManager(Node):
    def __init__(self):
        super().__init__("car_manager")
        self.declare_parameter("layers", ["lidar camera", "detector", "planner", "controller"])
        self.declare_parameter("optional", ["camera"])
        self.declare_parameter("patience", 1.0)
        self.car_state = self.create_publisher(String, "car_state", 10)
        self.layers = [text.split() for text in self.get_parameter("layers").value]
        self.optional = set(self.get_parameter("optional").value)
        self.patience = self.get_parameter("patience").value
        self.known = {}
        self.up = set()

    def call(self, name, kind, service, request):
        key = (name, service)
        if key not in self.known:
            self.known[key] = self.create_client(kind, f"{name}/{service}")
        client = self.known[key]
        if not client.wait_for_service(timeout_sec=self.patience):
            return None
        future = client.call_async(request)
        rclpy.spin_until_future_complete(self, future, timeout_sec=self.patience)
        if not future.done():
            client.remove_pending_request(future)
            return None
        return future.result()

    def state(self, name):
        answer = self.call(name, GetState, "get_state", GetState.Request())
        return answer.current_state.label if answer else "missing"

    def change(self, name, label):
        answer = self.call(name, ChangeState, "change_state", ChangeState.Request(transition=Transition(label=label)))
        return answer is not None and answer.success

    def bring_up(self, name):
        state = self.state(name)
        if state == "unconfigured":
            if not self.change(name, "configure"):
                return False
            state = "inactive"
        if state == "inactive":
            return self.change(name, "activate")
        return state == "active"

    def round(self):
        lost = []
        for layer in self.layers:
            failed = [name for name in layer if not self.bring_up(name)]
            self.up = (self.up | set(layer)) - set(failed)
            lost += failed
            if not self.optional.issuperset(failed):
                later = [name for rest in self.layers[self.layers.index(layer) + 1 :] for name in rest]
                for name in reversed(later):
                    if name in self.up:
                        self.up.discard(name)
                        self.change(name, "deactivate")
                return "waiting"
        return "degraded" if lost else "running"


def main():
    rclpy.init()
    manager = CarManager()
    try:
        while rclpy.ok():
            manager.car_state.publish(String(data=manager.round()))
            time.sleep(0.2)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
