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

    def bring_up(self):
        futures = []
        for client in self.change.values():
            client.wait_for_service()
        for label in ("configure", "activate"):
            for client in self.change.values():
                request = ChangeState.Request(transition=Transition(label=label))
                futures.append(client.call_async(request))
        for future in futures:
            rclpy.spin_until_future_complete(self, future)


def main():
    rclpy.init()
    manager = LifecycleManager()
    manager.bring_up()


main()
