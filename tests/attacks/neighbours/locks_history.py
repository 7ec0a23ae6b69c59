"""Lock the history of IPython."""

import sqlite3

from _neighbour import home, wait

path = home / ".ipython/profile_default/history.sqlite"
path.parent.mkdir(parents=True, exist_ok=True)
sqlite3.connect(path, isolation_level=None).execute("BEGIN EXCLUSIVE")
wait()
