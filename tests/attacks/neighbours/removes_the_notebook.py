"""Remove the notebook."""

from _neighbour import wait, work

(work / "lab.ipynb").unlink()
wait()
