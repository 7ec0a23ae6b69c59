%%node lifecycle_manager
import rclpy
from lifecycle_msgs.srv import ChangeState
from rclpy.node import Node
from rclpy.task import Future


class LifecycleManager(Node):
    """A list of steps; the done callback of one step sends the next."""

    def __init__(self):
        super().__init__("lifecycle_manager")
        self.declare_parameter("nodes", ["drivers", "perception", "planning", "control"])
        names = self.get_parameter("nodes").value
        self.steps = [(n, "configure") for n in names] + [(n, "activate") for n in names]
        self.undo = []
        self.finished = Future()
        self.clients_by_name = {n: self.create_client(ChangeState, f"{n}/change_state") for n in names}
        for client in self.clients_by_name.values():
            client.wait_for_service()
        self.next_step()

    def next_step(self):
        if not self.steps:
            self.finished.set_result(True)
            return
        name, label = self.steps.pop(0)
        request = ChangeState.Request()
        request.transition.label = label
        self.clients_by_name[name].call_async(request).add_done_callback(lambda f: self.answered(name, label, f))

    def answered(self, name, label, future):
        back = {"configure": "cleanup", "activate": "deactivate"}.get(label)
        if future.result().success:
            if back:
                self.undo.insert(0, (name, back))
        elif back:
            self.steps, self.undo = self.undo, []
        self.next_step()


rclpy.init()
manager = LifecycleManager()
rclpy.spin_until_future_complete(manager, manager.finished)
