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
        self.layers = [layer.split() for layer in self.get_parameter("layers").value]
        self.optional = self.get_parameter("optional").value
        self.patience = int(self.get_parameter("patience").value) or 30
        self.askers = {n: self.create_client(GetState, f"{n}/get_state") for layer in self.layers for n in layer}
        self.changers = {n: self.create_client(ChangeState, f"{n}/change_state") for layer in self.layers for n in layer}

    def ask(self, client, request):
        if not client.wait_for_service(timeout_sec=self.patience):
            return None
        future = client.call_async(request)
        rclpy.spin_until_future_complete(self, future, timeout_sec=self.patience)
        return future.result() if future.done() else None

    def state(self, name):
        answer = self.ask(self.askers[name], GetState.Request())
        return answer.current_state.label if answer else "unknown"

    def change(self, name, label):
        answer = self.ask(self.changers[name], ChangeState.Request(transition=Transition(label=label)))
        return answer is not None and answer.success

    def bring_up(self, name):
        state = self.state(name)
        if state == "unconfigured" and self.change(name, "configure"):
            state = "inactive"
        if state == "inactive" and self.change(name, "activate"):
            state = "active"
        return state == "active"

    def round(self):
        missing = []
        for layer in self.layers:
            down = [name for name in layer if not self.bring_up(name)]
            missing += down
            if any(name not in self.optional for name in down):
                return "waiting"
        return "degraded" if missing else "running"


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
