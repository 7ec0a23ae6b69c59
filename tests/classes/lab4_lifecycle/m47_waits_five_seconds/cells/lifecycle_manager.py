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
        self.change = {name: self.create_client(ChangeState, f"{name}/change_state") for name in self.names}

    def request(self, name, label):
        """Request one transition and wait for the answer."""
        if not self.change[name].wait_for_service(timeout_sec=5.0):
            return False
        future = self.change[name].call_async(ChangeState.Request(transition=Transition(label=label)))
        rclpy.spin_until_future_complete(self, future)
        return future.result().success

    def bring_up(self):
        configured, activated = [], []
        for label, done in (("configure", configured), ("activate", activated)):
            for name in self.names:
                if not self.request(name, label):
                    self.get_logger().error(f"{name} cannot {label}: rolling back")
                    for active in reversed(activated):
                        self.request(active, "deactivate")
                    for inactive in reversed(configured):
                        self.request(inactive, "cleanup")
                    return False
                done.append(name)
        return True


def main():
    rclpy.init()
    manager = LifecycleManager()
    if manager.bring_up():
        manager.get_logger().info("all nodes are active")


main()
