%%node car_manager
import threading
import time

import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import String

CONFIGURE, ACTIVATE = Transition(label="configure"), Transition(label="activate")


def ask(node, client, request, patience):
    """Wait in this thread, while another one spins."""
    if not client.wait_for_service(timeout_sec=patience):
        return None
    came = threading.Event()
    future = client.call_async(request)
    future.add_done_callback(lambda _: came.set())
    return future.result() if came.wait(patience) else None


def main():
    rclpy.init()
    node = Node("car_manager")
    layers = [text.split() for text in node.declare_parameter("layers", [""]).value]
    optional = set(node.declare_parameter("optional", [""]).value)
    patience = node.declare_parameter("patience", 1.0).value
    car_state = node.create_publisher(String, "car_state", 10)
    state_of = {name: node.create_client(GetState, name + "/get_state") for layer in layers for name in layer}
    change_of = {name: node.create_client(ChangeState, name + "/change_state") for name in state_of}
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    spinner = threading.Thread(target=executor.spin)
    spinner.start()

    def is_active(name):
        reply = ask(node, state_of[name], GetState.Request(), patience)
        label = reply.current_state.label if reply else "gone"
        if label == "unconfigured":
            reply = ask(node, change_of[name], ChangeState.Request(transition=CONFIGURE), patience)
            label = "inactive" if reply and reply.success else "refused"
        if label == "inactive":
            reply = ask(node, change_of[name], ChangeState.Request(transition=ACTIVATE), patience)
            label = "active" if reply and reply.success else "refused"
        return label == "active"

    try:
        while rclpy.ok():
            verdict = "running"
            for layer in layers:
                down = {name for name in layer if not is_active(name)}
                if down - optional:
                    verdict = "waiting"
                    break
                if down:
                    verdict = "degraded"
            car_state.publish(String(data=verdict))
            time.sleep(0.3)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        executor.shutdown()
        rclpy.try_shutdown()
        spinner.join()


if __name__ == "__main__":
    main()
