"""Publish in the notebook's domain under an observer's name."""

from _neighbour import join

join("grading_observer_000001")
