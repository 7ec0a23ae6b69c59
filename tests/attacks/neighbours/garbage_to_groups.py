"""Send garbage to the multicast group in which the programs find each other."""

from _neighbour import garbage, groups

garbage(groups)
