%%node lifecycle_manager
import rclpy
from lifecycle_msgs.msg import State
from lifecycle_msgs.srv import ChangeState, GetAvailableTransitions, GetState
from rclpy.node import Node


class LifecycleManager(Node):
    """Asks first what is available, as `ros2 lifecycle set` does, and rolls back by looking at the states."""

    def __init__(self):
        super().__init__("lifecycle_manager")
        self.names = list(self.declare_parameter("nodes", ["drivers", "perception", "planning", "control"]).value)

    def ask(self, name, kind, service, request):
        client = self.create_client(kind, f"{name}/{service}")
        while not client.wait_for_service(timeout_sec=1.0):
            self.get_logger().info(f"waiting for {name}")
        future = client.call_async(request)
        rclpy.spin_until_future_complete(self, future)
        self.destroy_client(client)
        return future.result()

    def go(self, name, label):
        offered = self.ask(name, GetAvailableTransitions, "get_available_transitions", GetAvailableTransitions.Request())
        for description in offered.available_transitions:
            if description.transition.label == label:
                request = ChangeState.Request(transition=description.transition)
                return self.ask(name, ChangeState, "change_state", request).success
        return False

    def up(self):
        return all(self.go(name, label) for label in ("configure", "activate") for name in self.names)

    def down(self):
        for name in reversed(self.names):
            state = self.ask(name, GetState, "get_state", GetState.Request()).current_state.id
            if state == State.PRIMARY_STATE_ACTIVE:
                self.go(name, "deactivate")
                state = State.PRIMARY_STATE_INACTIVE
            if state == State.PRIMARY_STATE_INACTIVE:
                self.go(name, "cleanup")


rclpy.init()
manager = LifecycleManager()
if not manager.up():
    manager.down()
manager.destroy_node()
rclpy.shutdown()
