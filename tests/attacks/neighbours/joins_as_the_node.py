"""Publish in the notebook's domain under the node's own name."""

from _neighbour import join

join("talker")
