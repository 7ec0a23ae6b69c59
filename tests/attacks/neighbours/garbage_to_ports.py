"""Send garbage to the domain's ports."""

from _neighbour import garbage

garbage(lambda: ["127.0.0.1"])
