import itertools
import threading
import time

import rclpy
from rclpy.executors import ExternalShutdownException
from std_msgs.msg import String


def main():
    rclpy.init()
    node = rclpy.create_node("long_timer")
    node.declare_parameter("period", 0.2)
    node.declare_parameter("work", 1.0)
    numbers, free = itertools.count(1), threading.Semaphore(4)
    activity = node.create_publisher(String, "activity", 10)

    def tick():
        number = next(numbers)
        activity.publish(String(data=f"tick {number} begin"))
        time.sleep(node.get_parameter("work").value)
        activity.publish(String(data=f"tick {number} end"))
        free.release()

    def start():
        if free.acquire(blocking=False):
            threading.Thread(target=tick, daemon=True).start()

    node.create_timer(node.get_parameter("period").value, start)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
