%%node sensor_publisher
import rclpy
from rclpy.node import Node
from std_msgs.msg import String


class SensorPublisher(Node):
    def __init__(self):
        super().__init__("sensor_publisher")
        self.declare_parameter("period", 1.0)
        self.count = 0
        self.publisher = self.create_publisher(String, "sensor_data", 10)
        self.create_timer(self.get_parameter("period").value, self.publish_reading)

    def publish_reading(self):
        self.count += 1
        self.publisher.publish(String(data=f"Sensor reading {self.count}"))


rclpy.init()
rclpy.spin(SensorPublisher())
