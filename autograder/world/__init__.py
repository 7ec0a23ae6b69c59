"""A small world to drive in: a car in a room seen from above, as ROS nodes, with a record of what happened.

The room, the car and what its sensors see are arithmetic on arrays (`room`, `rays`, `car`, `simulation`); `node`
connects them to ROS, and `drawing` draws them. numpy alone does this: it comes with rclpy's messages, while shapely has
no function that casts many rays at once, and pymunk solves contacts between many moving bodies, which a few cars do not
need.
"""

from autograder.world.node import RunningWorld
from autograder.world.room import Pose, Room, read_room, room_from
from autograder.world.simulation import Sample, Simulation, Touch

__all__ = ["Pose", "Room", "RunningWorld", "Sample", "Simulation", "Touch", "read_room", "room_from"]
