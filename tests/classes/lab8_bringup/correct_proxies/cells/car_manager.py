%%node car_manager
import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import String


class NodeProxy:
    def __init__(self, manager, name, group):
        self.name, self.manager = name, manager
        self.get_state = manager.create_client(GetState, f"{name}/get_state", callback_group=group)
        self.change_state = manager.create_client(ChangeState, f"{name}/change_state", callback_group=group)

    def ask(self, client, request):
        patience = self.manager.get_parameter("patience").value
        if not client.wait_for_service(timeout_sec=patience):
            return None
        return client.call(request, timeout_sec=patience)

    def label(self):
        try:
            answer = self.ask(self.get_state, GetState.Request())
        except TimeoutError:
            answer = None
        return "" if answer is None else answer.current_state.label

    def change(self, label):
        try:
            answer = self.ask(self.change_state, ChangeState.Request(transition=Transition(label=label)))
        except TimeoutError:
            answer = None
        return answer is not None and answer.success

    def active(self):
        label = self.label()
        if label == "unconfigured" and self.change("configure"):
            label = "inactive"
        return label == "active" or (label == "inactive" and self.change("activate"))


class CarManager(Node):
    def __init__(self):
        super().__init__("car_manager")
        layers = self.declare_parameter("layers", ["lidar"]).value
        self.optional = self.declare_parameter("optional", ["camera"]).value
        self.declare_parameter("patience", 1.0)
        group = ReentrantCallbackGroup()
        self.layers = [[NodeProxy(self, name, group) for name in layer.split()] for layer in layers]
        self.car_state = self.create_publisher(String, "car_state", 10)
        self.create_timer(0.3, self.round)

    def round(self):
        self.car_state.publish(String(data=self.verdict()))

    def verdict(self):
        verdict = "running"
        for layer in self.layers:
            for proxy in layer:
                if not proxy.active():
                    verdict = "waiting" if proxy.name not in self.optional or verdict == "waiting" else "degraded"
            if verdict == "waiting":
                return verdict
        return verdict


def main():
    rclpy.init()
    executor = MultiThreadedExecutor(num_threads=3)
    executor.add_node(CarManager())
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
