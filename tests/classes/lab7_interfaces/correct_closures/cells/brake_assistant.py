%%node brake_assistant
import rclpy
from car_interfaces.srv import CountObjects
from geometry_msgs.msg import Point
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Bool


def main():
    rclpy.init()
    node = rclpy.create_node("brake_assistant")
    brake = Bool(data=True)
    publisher = node.create_publisher(Bool, "brake", 10)
    client = node.create_client(CountObjects, "count_objects")

    def silence():
        brake.data = True

    watchdog = node.create_timer(1.0, silence)

    def answered(future):
        watchdog.reset()
        result = future.result()
        brake.data = not result.success or result.count > 0

    def ask():
        request = CountObjects.Request()
        request.labels.extend(("person", "bicycle"))
        request.low.x, request.low.y = 0.0, -1.5
        request.high.x, request.high.y = 10.0, 1.5
        client.call_async(request).add_done_callback(answered)

    node.create_timer(0.2, ask)
    node.create_timer(0.2, lambda: publisher.publish(brake))
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
