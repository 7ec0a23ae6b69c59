%%node car_manager
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
        self.patience = self.get_parameter("patience").value
        self.getters, self.changers = {}, {}
        self.active = {name: False for layer in self.layers for name in layer}
        for layer in self.layers:
            for name in layer:
                self.getters[name] = self.create_client(GetState, f"{name}/get_state")
                self.changers[name] = self.create_client(ChangeState, f"{name}/change_state")

    def call(self, client, request):
        if not client.wait_for_service(timeout_sec=self.patience):
            return None
        future = client.call_async(request)
        rclpy.spin_until_future_complete(self, future, timeout_sec=self.patience)
        if not future.done():
            client.remove_pending_request(future)
            return None
        return future.result()

    def change(self, name, label):
        answer = self.call(self.changers[name], ChangeState.Request(transition=Transition(label=label)))
        return answer is not None and answer.success

    def bring_up(self, name):
        answer = self.call(self.getters[name], GetState.Request())
        if answer is None:
            return False
        state = answer.current_state.label
        if state == "unconfigured":
            if not self.change(name, "configure"):
                return False
            state = "inactive"
        if state == "inactive":
            return self.change(name, "activate")
        return state == "active"

    def is_active(self, name):
        if not self.getters[name].service_is_ready():
            return False
        answer = self.call(self.getters[name], GetState.Request())
        return answer is not None and answer.current_state.label == "active"

    def round(self):
        active = self.active
        before = []
        for layer in self.layers:
            if all(self.is_active(name) for name in before if name not in self.optional):
                for name in layer:
                    active[name] = self.bring_up(name)
            before = layer
        missing = [name for name in active if not active[name]]
        if not missing:
            return "running"
        if all(name in self.optional for name in missing):
            return "degraded"
        return "waiting"


def main():
    rclpy.init()
    manager = CarManager()
    try:
        while rclpy.ok():
            manager.car_state.publish(String(data=manager.round()))
            rclpy.spin_once(manager, timeout_sec=0.2)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
