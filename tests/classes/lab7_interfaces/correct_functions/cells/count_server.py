import rclpy
from car_interfaces.msg import DetectedObjectArray
from car_interfaces.srv import CountObjects
from rclpy.executors import ExternalShutdownException
from std_msgs.msg import Int32

state = {}


def main():
    rclpy.init()
    node = rclpy.create_node("count_server")
    out = node.create_publisher(Int32, "detected", 1)

    def keep(message):
        state["objects"] = [(o.label, o.position.x, o.position.y) for o in message.objects]
        out.publish(Int32(data=len(state["objects"])))

    def count(request, _):
        if "objects" not in state:
            return CountObjects.Response()
        inside = lambda x, y: request.low.x <= x <= request.high.x and not (y < request.low.y or y > request.high.y)
        wanted = set(request.labels)
        names = [name for name, x, y in state["objects"] if inside(x, y) and (name in wanted or not wanted)]
        return CountObjects.Response(success=True, count=len(names), found=list(dict.fromkeys(names)))

    node.create_subscription(DetectedObjectArray, "detections", keep, 5)
    node.create_service(CountObjects, "count_objects", count)
    try:
        while True:
            rclpy.spin_once(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        rclpy.try_shutdown()


main()
