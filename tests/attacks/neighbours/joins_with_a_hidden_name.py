"""Publish in the notebook's domain under a hidden name."""

from _neighbour import join

join("_hidden")
