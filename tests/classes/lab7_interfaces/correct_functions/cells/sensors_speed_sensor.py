import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from std_msgs.msg import Float64
from std_srvs.srv import SetBool


def main(args=None):
    rclpy.init(args=args)
    node = rclpy.create_node("speed_sensor")
    speed = node.declare_parameter("speed", 5.0)
    publisher = node.create_publisher(Float64, "speed", 1)
    timer = node.create_timer(1 / 10, lambda: publisher.publish(Float64(data=speed.value)))

    def enable(request, response):
        timer.reset() if request.data else timer.cancel()
        return SetBool.Response(success=True, message="on" if request.data else "off")

    node.create_service(SetBool, "enable", enable)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
