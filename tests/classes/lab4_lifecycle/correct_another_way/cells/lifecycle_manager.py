import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.executors import SingleThreadedExecutor


class Remote:
    """One lifecycle node, as the manager sees it."""

    def __init__(self, node, executor, name):
        self.client = node.create_client(ChangeState, f"{name}/change_state")
        self.executor, self.undo = executor, []

    def go(self, label, undo=None):
        while not self.client.wait_for_service(timeout_sec=0.5):
            pass
        future = self.client.call_async(ChangeState.Request(transition=Transition(label=label)))
        self.executor.spin_until_future_complete(future)
        done = future.result().success
        if done and undo:
            self.undo.append(undo)
        return done

    def back(self):
        while self.undo:
            self.go(self.undo.pop())


def main():
    rclpy.init()
    node = rclpy.create_node("lifecycle_manager")
    names = node.declare_parameter("nodes", ["drivers", "perception", "planning", "control"])
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    vehicle = [Remote(node, executor, name) for name in names.value]
    up = all(one.go("configure", "cleanup") for one in vehicle)
    if not (up and all(one.go("activate", "deactivate") for one in vehicle)):
        for one in reversed(vehicle):  # node by node
            one.back()
    rclpy.shutdown()


main()
