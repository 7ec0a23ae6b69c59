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
        self.optional = self.get_parameter("optional").value
        self.patience = self.get_parameter("patience").value
        self.service_clients = {}

    def ask(self, service_type, service, request):
        """The answer, or None."""
        client = self.service_clients.get(service)
        if client is None:
            client = self.service_clients[service] = self.create_client(service_type, service)
        if not client.wait_for_service(timeout_sec=self.patience):
            return None
        future = client.call_async(request)
        rclpy.spin_until_future_complete(self, future, timeout_sec=self.patience)
        return future.result() if future.done() else None

    def change(self, name, label):
        answer = self.ask(ChangeState, f"{name}/change_state", ChangeState.Request(transition=Transition(label=label)))
        return answer is not None and answer.success

    def bring_up(self, name):
        answer = self.ask(GetState, f"{name}/get_state", GetState.Request())
        state = answer.current_state.label if answer else ""
        if state == "unconfigured" and self.change(name, "configure"):
            state = "inactive"
        if state == "inactive" and self.change(name, "activate"):
            state = "active"
        self.is_active[name] = state == "active"
        return self.is_active[name]

    def round(self):
        self.is_active = {name: False for layer in self.layers for name in layer}
        for layer in self.layers:
            if not all(self.bring_up(name) or name in self.optional for name in layer):
                break  # the next layer has to wait
        missing = [name for name, active in self.is_active.items() if not active]
        if not missing:
            return "running"
        return "degraded" if all(name in self.optional for name in missing) else "waiting"


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
