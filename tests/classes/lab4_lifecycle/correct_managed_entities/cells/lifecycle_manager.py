%%node lifecycle_manager
import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node


class LifecycleManager(Node):
    """A coroutine that awaits each answer; the executor runs it."""

    def __init__(self):
        super().__init__("lifecycle_manager")
        self.declare_parameter("nodes", ["drivers", "perception", "planning", "control"])
        self.clients_of = {
            name: self.create_client(ChangeState, name + "/change_state") for name in self.get_parameter("nodes").value
        }

    async def change(self, name, label):
        answer = await self.clients_of[name].call_async(ChangeState.Request(transition=Transition(label=label)))
        return answer.success

    async def run(self):
        for client in self.clients_of.values():
            client.wait_for_service()
        active = []
        configured = []
        for name in self.clients_of:
            if not await self.change(name, "configure"):
                return await self.roll_back(configured, active)
            configured.append(name)
        for name in self.clients_of:
            if not await self.change(name, "activate"):
                return await self.roll_back(configured, active)
            active.append(name)

    async def roll_back(self, configured, active):
        for name in configured[::-1]:
            if name in active:
                await self.change(name, "deactivate")
            await self.change(name, "cleanup")


rclpy.init()
node = LifecycleManager()
executor = SingleThreadedExecutor()
executor.add_node(node)
executor.spin_until_future_complete(executor.create_task(node.run))
