"""Pictures of what ROS programs did: runs of callbacks, the graph, lifecycle states, QoS matches, arriving messages.

They are drawn from plain data, as SVG that is also readable in black and white, and each has a description in words of
what it shows. Check cells, lectures and the reports of failed checks use the same pictures.
"""

from autograder.core.results import Picture
from autograder.pictures.arrivals import Traffic, arrivals, drawn
from autograder.pictures.graph import Endpoint, graph, qos
from autograder.pictures.lifecycle import lifecycle, steps
from autograder.pictures.timeline import Run, Runs, timeline

__all__ = [
    "Endpoint",
    "Picture",
    "Run",
    "Runs",
    "Traffic",
    "arrivals",
    "drawn",
    "graph",
    "lifecycle",
    "qos",
    "steps",
    "timeline",
]
