%%node lifecycle_manager
import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.node import Node


class LifecycleManager(Node):
    def __init__(self):
        super().__init__("lifecycle_manager")
        self.declare_parameter("nodes", ["drivers", "perception", "planning", "control"])
        self.names = self.get_parameter("nodes").value
        self.change_state = {name: self.create_client(ChangeState, f"{name}/change_state") for name in self.names}

    def request(self, name, label):
        future = self.change_state[name].call_async(ChangeState.Request(transition=Transition(label=label)))
        rclpy.spin_until_future_complete(self, future)
        return future.result().success

    def take_back(self, name, label):
        future = self.change_state[name].call_async(ChangeState.Request(transition=Transition(label=label)))
        rclpy.spin_until_future_complete(self, future, timeout_sec=1.0)  # something is broken already, so do not hang here

    def bring_up(self):
        for client in self.change_state.values():
            client.wait_for_service()
        configured, active = [], []
        for name in self.names:
            if not self.request(name, "configure"):
                for other in reversed(configured):
                    self.take_back(other, "cleanup")
                return False
            configured.append(name)
        for name in self.names:
            if not self.request(name, "activate"):
                for other in reversed(active):
                    self.take_back(other, "deactivate")
                for other in reversed(configured):
                    self.take_back(other, "cleanup")
                return False
            active.append(name)
        return True


def main():
    rclpy.init()
    manager = LifecycleManager()
    if manager.bring_up():
        manager.get_logger().info("all nodes are active")


main()
