"""Pictures of what ROS programs did: who ran when, who talks to whom, which state, which match, which arrival.

They are drawn from plain data, as SVG with text that can be read in black and white, and each says in words what it
shows. A check cell, a lecture and the report under a failed check draw the same ones.
"""

from autograder.core.results import Picture
from autograder.pictures.graph import Endpoint, graph, qos
from autograder.pictures.lifecycle import lifecycle, steps
from autograder.pictures.timeline import Run, Runs, Traffic, arrivals, timeline

__all__ = [
    "Endpoint",
    "Picture",
    "Run",
    "Runs",
    "Traffic",
    "arrivals",
    "graph",
    "lifecycle",
    "qos",
    "steps",
    "timeline",
]
