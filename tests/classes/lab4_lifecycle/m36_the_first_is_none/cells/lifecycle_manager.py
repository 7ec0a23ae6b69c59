%%node lifecycle_manager
import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.node import Node


class LifecycleManager(Node):
    def __init__(self):
        super().__init__("lifecycle_manager")
        self.declare_parameter("nodes", ["drivers", "perception", "planning", "control"])
        self.names = list(self.get_parameter("nodes").value)
        self.changers = {name: self.create_client(ChangeState, f"{name}/change_state") for name in self.names}

    def request(self, name, label):
        future = self.changers[name].call_async(ChangeState.Request(transition=Transition(label=label)))
        rclpy.spin_until_future_complete(self, future)
        return future.result().success

    def wait_for_nodes(self):
        for name in self.names:
            while not self.changers[name].wait_for_service(timeout_sec=1.0):
                self.get_logger().info(f"waiting for {name}")

    def bring_up(self):
        self.wait_for_nodes()
        failed = self.first_failure("configure")
        if failed is not None:
            self.roll_back(self.names[:failed], [])
            return False
        failed = self.first_failure("activate")
        if failed:
            self.roll_back(self.names, self.names[:failed])
            return False
        return True

    def first_failure(self, label):
        for index, name in enumerate(self.names):
            if not self.request(name, label):
                return index
        return None

    def roll_back(self, configured, activated):
        for name in reversed(activated):
            self.request(name, "deactivate")
        for name in reversed(configured):
            self.request(name, "cleanup")


def main():
    rclpy.init()
    manager = LifecycleManager()
    if manager.bring_up():
        manager.get_logger().info("all nodes are active")


main()
