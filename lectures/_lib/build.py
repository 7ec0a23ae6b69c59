"""Build book and slides: `python build.py OUTPUT [more options for Sphinx]`, every lecture's cells included.

What a lecture measures is measured once more if it did not hold (`_ext/execution.py`).
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

LECTURES = Path(__file__).resolve().parent.parent
TARGETS = (("html", "book", LECTURES), ("revealjs", "slides", LECTURES / "slides"))


def build(output: Path, options: list[str]) -> int:
    """Build both into a folder, and return Sphinx' exit status.

    Args:
        output: gets `book` and `slides`, in each of them its executed `notebooks`, and what Sphinx keeps for the next
            time. Lectures that have run are not run again as long as their cells are the same.
        options: for Sphinx.
    """
    for builder, name, source in TARGETS:
        command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", builder, "-c", str(LECTURES)]
        command += ["-d", str(output / "doctrees" / name), "-D", f"nb_execution_cache_path={output / 'cache'}"]
        command += [*options, str(source), str(output / name)]
        status = subprocess.run(command).returncode
        if status != 0:
            return status
        # MyST-NB writes those of both builds into one folder, where a talk would take the place of its lecture.
        if (output / "jupyter_execute").is_dir():
            shutil.copytree(output / "jupyter_execute", output / name / "notebooks", dirs_exist_ok=True)
            shutil.rmtree(output / "jupyter_execute")
    return 0


if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    sys.exit(build(Path(sys.argv[1]).resolve(), sys.argv[2:]))
