%%node lifecycle_manager
import sys
import threading

import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.executors import SingleThreadedExecutor


def main():
    rclpy.init()
    node = rclpy.create_node("lifecycle_manager")
    names = node.declare_parameter("nodes", ["drivers", "perception", "planning", "control"]).value
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    spinner = threading.Thread(target=executor.spin)
    spinner.start()

    def change(name, label):
        client = node.create_client(ChangeState, f"{name}/change_state")
        client.wait_for_service()
        request = ChangeState.Request()
        request.transition.label = label
        return client.call(request).success

    undo = []
    ok = True
    for label, back in (("configure", "cleanup"), ("activate", "deactivate")):
        for name in names:
            if not change(name, label):
                ok = False
                break
            undo.append((name, back))
        if not ok:
            break
    if not ok:
        while undo:
            change(*undo.pop())
    executor.shutdown()
    spinner.join()
    sys.exit(0 if ok else 1)


main()
