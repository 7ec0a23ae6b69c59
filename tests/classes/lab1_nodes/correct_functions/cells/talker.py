%%node talker
import rclpy
from rclpy.executors import ExternalShutdownException
from std_msgs.msg import String


def main():
    rclpy.init()
    node = rclpy.create_node("talker")
    said = 0
    publisher = node.create_publisher(String, "chatter", 10)

    def talk():
        nonlocal said
        message = String()
        message.data = "hello " + str(said)
        publisher.publish(message)
        said = said + 1

    node.create_timer(1 / 10, talk)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
