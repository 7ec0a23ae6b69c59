"""Lay files that Python runs at its start beside the notebook."""

from _neighbour import shadow, wait

shadow("sitecustomize.py", "usercustomize.py")
wait()
