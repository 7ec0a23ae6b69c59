"""Lay a program of the same name beside the notebook."""

from _neighbour import shadow, wait

shadow("talker.py")
wait()
