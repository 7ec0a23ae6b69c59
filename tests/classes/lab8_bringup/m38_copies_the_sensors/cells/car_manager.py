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
        names = [name for layer in self.layers for name in layer]
        self.get = {name: self.create_client(GetState, f"{name}/get_state") for name in names}
        self.change = {name: self.create_client(ChangeState, f"{name}/change_state") for name in names}

    def ask(self, client, request):
        """Return the answer, or None if none comes in time."""
        patience = 0.5
        if not client.wait_for_service(patience):
            return None
        future = client.call_async(request)
        rclpy.spin_until_future_complete(self, future, timeout_sec=patience)
        if not future.done():
            client.remove_pending_request(future)
            return None
        return future.result()

    def bring_up(self, name):
        """Request the transitions that are left, and return whether the node is active."""
        answer = self.ask(self.get[name], GetState.Request())
        state = answer.current_state.label if answer else ""
        for label in {"unconfigured": ["configure", "activate"], "inactive": ["activate"]}.get(state, []):
            answer = self.ask(self.change[name], ChangeState.Request(transition=Transition(label=label)))
            if answer is None or not answer.success:
                return False
            state = "active" if label == "activate" else "inactive"
        return state == "active"

    def round(self):
        optional = self.get_parameter("optional").value
        missing = []
        for layer in self.layers:
            for name in layer:
                if not self.bring_up(name):
                    missing.append(name)
                    if name not in optional and not self.get[name].service_is_ready():
                        break
            if not set(missing) <= set(optional):
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
