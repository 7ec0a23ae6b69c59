"""What attacks share: a publisher below rclpy, on any DDS topic, of any bytes. No attack itself."""

import ctypes
import struct

import rclpy  # noqa: F401  loads the libraries

TRANSIENT_LOCAL, VOLATILE = 1, 2
rcl, rmw = ctypes.CDLL("librcl.so"), ctypes.CDLL("librmw_fastrtps_cpp.so")


class Options(ctypes.Structure):
    """`rmw_publisher_options_t`."""

    _fields_ = (("payload", ctypes.c_void_p), ("flow", ctypes.c_int))


def publisher(node, topic, package, kind, durability=TRANSIENT_LOCAL):
    """Return a function that publishes bytes under a topic name that rclpy would change or refuse."""
    library = ctypes.CDLL(f"lib{package}__rosidl_typesupport_c.so")
    support = getattr(library, f"rosidl_typesupport_c__get_message_type_support_handle__{package}__msg__{kind}")
    support.restype = rcl.rcl_node_get_rmw_handle.restype = rmw.rmw_create_publisher.restype = ctypes.c_void_p
    handle = rcl.rcl_node_get_rmw_handle(ctypes.c_void_p(node.handle.pointer))
    # History, depth, reliability, durability, deadline, lifespan, liveliness, lease, "no ROS name conventions".
    profile = struct.pack("@iNiiQQQQiQQ?7x", 1, 10, 1, durability, 0, 0, 0, 0, 1, 0, 0, True)
    made = rmw.rmw_create_publisher(
        ctypes.c_void_p(handle), ctypes.c_void_p(support()), topic, profile, ctypes.byref(Options(None, 0))
    )
    if not made:
        raise OSError("no publisher")

    def publish(data):
        content = ctypes.create_string_buffer(data, len(data))
        message = struct.pack("@PNN40x", ctypes.addressof(content), len(data), len(data))
        return rmw.rmw_publish_serialized_message(ctypes.c_void_p(made), message, None)

    return publish
