"""Lay files that Python runs at its start into the home."""

import sys

from _neighbour import home, wait

packages = home / f".local/lib/python{sys.version_info.major}.{sys.version_info.minor}/site-packages"
packages.mkdir(parents=True, exist_ok=True)
(packages / "usercustomize.py").write_text("raise SystemExit(3)\n")
(packages / "all.pth").write_text("import os; os._exit(3)\n")
wait()
