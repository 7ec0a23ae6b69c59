%%node sensor_monitor
"""One profile for all four ends: best effort with the alarm's deadline."""
from functools import partial

import rclpy
from rclpy.duration import Duration
from rclpy.qos import QoSProfile, QoSReliabilityPolicy
from sensor_msgs.msg import Temperature
from std_msgs.msg import Int64MultiArray


def main():
    rclpy.init()
    node = rclpy.create_node("sensor_monitor")
    profile = QoSProfile(depth=20)
    profile.reliability = QoSReliabilityPolicy.BEST_EFFORT
    profile.deadline = Duration(nanoseconds=200_000_000)
    numbers = [0, 0, 0, 0]

    def heard(index, _):
        numbers[index] += 1

    temperature = node.create_publisher(Temperature, "temperature", profile)
    counts = node.create_publisher(Int64MultiArray, "counts", 1)
    for index in (1, 2, 3):
        node.create_subscription(Temperature, "temperature", partial(heard, index), profile)

    def tick():
        temperature.publish(Temperature(temperature=21.5, variance=0.1))
        numbers[0] += 1
        counts.publish(Int64MultiArray(data=numbers))

    node.create_timer(0.1, tick)
    rclpy.spin(node)


if __name__ == "__main__":
    main()
