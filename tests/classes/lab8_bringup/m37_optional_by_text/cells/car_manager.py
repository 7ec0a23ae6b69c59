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
        self.optional = " ".join(self.get_parameter("optional").value)
        self.patience = self.get_parameter("patience").value
        self.state_clients = {}
        self.change_clients = {}
        for layer in self.layers:
            for name in layer:
                self.state_clients[name] = self.create_client(GetState, f"{name}/get_state")
                self.change_clients[name] = self.create_client(ChangeState, f"{name}/change_state")

    def ask(self, client, request):
        if not client.wait_for_service(timeout_sec=self.patience):
            return None
        future = client.call_async(request)
        rclpy.spin_until_future_complete(self, future, timeout_sec=self.patience)
        return future.result() if future.done() else None

    def change(self, name, label):
        answer = self.ask(self.change_clients[name], ChangeState.Request(transition=Transition(label=label)))
        return answer is not None and answer.success

    def bring_up(self, name):
        answer = self.ask(self.state_clients[name], GetState.Request())
        if answer is None:
            return False
        state = answer.current_state.label
        if state == "unconfigured" and self.change(name, "configure"):
            state = "inactive"
        if state == "inactive" and self.change(name, "activate"):
            state = "active"
        return state == "active"

    def is_optional(self, name):
        return name in self.optional

    def round(self):
        missing = [name for layer in self.layers for name in layer]
        for layer in self.layers:
            for name in layer:
                if self.bring_up(name):
                    missing.remove(name)
            if any(name in missing and not self.is_optional(name) for name in layer):
                break
        if not missing:
            return "running"
        return "degraded" if all(self.is_optional(name) for name in missing) else "waiting"


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
