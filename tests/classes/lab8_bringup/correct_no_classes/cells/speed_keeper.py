%%node speed_keeper
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Float64, Int32


def main():
    rclpy.init()
    node = Node("speed_keeper")
    patience = node.declare_parameter("patience", 0.5).value
    clock = node.get_clock()
    times = {}
    node.create_subscription(Int32, "scan", lambda msg: times.update(scan=clock.now()), 10)
    node.create_subscription(Int32, "obstacles", lambda msg: times.update(obstacles=clock.now()), 10)
    speed = node.create_publisher(Float64, "speed", 10)

    def fresh(topic):
        return topic in times and (clock.now() - times[topic]).nanoseconds <= patience * 1e9

    def decide():
        if fresh("obstacles"):
            return 2.0
        if fresh("scan"):
            return 0.5
        return 0.0

    node.create_timer(0.1, lambda: speed.publish(Float64(data=decide())))
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


main()
