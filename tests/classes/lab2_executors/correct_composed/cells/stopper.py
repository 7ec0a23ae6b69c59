import threading

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Empty, Int64


class Stopper(Node):
    def __init__(self, told):
        super().__init__("stopper")
        self.declare_parameter("tick_period", 0.1)
        self.count = 0
        self.ticks = self.create_publisher(Int64, "ticks", 10)
        self.create_timer(self.get_parameter("tick_period").value, self.tick)
        self.create_subscription(Empty, "stop", lambda _: told.set(), 10)

    def tick(self):
        self.count += 1
        self.ticks.publish(Int64(data=self.count))


def main():
    """An executor spins in a thread; `main` waits for an event, then ends it from outside."""
    rclpy.init()
    told = threading.Event()
    node, executor = Stopper(told), SingleThreadedExecutor()
    executor.add_node(node)
    thread = threading.Thread(target=executor.spin)
    thread.start()
    try:
        while rclpy.ok() and not told.wait(0.1):
            pass
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    executor.shutdown()
    thread.join()
    node.destroy_node()
    rclpy.try_shutdown()
    print("ended")


if __name__ == "__main__":
    main()
