%%node talker
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import String


class Talker(Node):
    def __init__(self):
        super().__init__("talker")
        self.message = String(data="hello 0")
        self.publisher = self.create_publisher(String, "chatter", 10)
        self.create_timer(0.1, self.talk)

    def talk(self):
        self.publisher.publish(self.message)
        word, number = self.message.data.split()
        self.message.data = f"{word} {int(number) + 1}"


def main():
    rclpy.init()
    try:
        rclpy.spin(Talker())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
