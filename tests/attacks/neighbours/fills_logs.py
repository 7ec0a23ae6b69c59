"""Fill the folder of logs."""

from _neighbour import logs, wait

logs.mkdir(mode=0o700, exist_ok=True)
for number in range(3000):
    (logs / f"python3_{number}_1.log").touch()
wait()
