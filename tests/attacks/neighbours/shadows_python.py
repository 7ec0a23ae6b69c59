"""Lay modules with the names of Python's own beside the notebook."""

from _neighbour import shadow, wait

shadow("json.py", "socket.py", "threading.py", "random.py", "typing.py")
wait()
