"""Lock the notebook in both ways."""

import fcntl

from _neighbour import wait, work

with (work / "lab.ipynb").open("r+") as file:
    fcntl.flock(file, fcntl.LOCK_EX)
    fcntl.lockf(file, fcntl.LOCK_EX)
    wait()
