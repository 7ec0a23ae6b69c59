"""Takes memory until it is stopped.

Must, alone: memory limit.
"""

hoard = []
while True:
    hoard.append(bytearray(8 * 1024 * 1024))
