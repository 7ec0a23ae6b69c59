%%node lifecycle_manager
import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.node import Node


class LifecycleManager(Node):
    def __init__(self):
        super().__init__("lifecycle_manager")
        default = ["drivers", "perception", "planning", "control"]
        self.names = list(self.declare_parameter("nodes", default).value)
        self.doors = {name: self.create_client(ChangeState, f"{name}/change_state") for name in self.names}

    def change(self, name, label):
        if not self.doors[name].wait_for_service(timeout_sec=1.0):
            return False
        future = self.doors[name].call_async(ChangeState.Request(transition=Transition(label=label)))
        rclpy.spin_until_future_complete(self, future)
        return future.result().success

    def bring_up(self):
        self.doors[self.names[0]].wait_for_service()  # the others come with it
        configured, activated = [], []
        for label, done in (("configure", configured), ("activate", activated)):
            for name in self.names:
                if not self.change(name, label):
                    self.get_logger().error(f"{name} does not {label}")
                    self.roll_back(configured, activated)
                    return False
                done.append(name)
        return True

    def roll_back(self, configured, activated):
        for name in reversed(activated):
            self.change(name, "deactivate")
        for name in reversed(configured):
            self.change(name, "cleanup")


def main():
    rclpy.init()
    manager = LifecycleManager()
    if manager.bring_up():
        manager.get_logger().info("all nodes are active")


main()
