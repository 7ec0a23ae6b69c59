"""A virtual environment with the kit in it as a wheel, as a course elsewhere has it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from linked import link_tree
from places import ROOT


class Environment:
    """A virtual environment with the wheel in it and nothing of the checkout."""

    def __init__(self, folder: Path, python: str = sys.executable) -> None:
        """Make the environment `venv` in a folder, of a Python of the same version as this one."""
        source = folder / "source"
        source.mkdir(parents=True)
        for name in ("pyproject.toml", "README.md", "LICENSE"):
            shutil.copy(ROOT / name, source)
        shutil.copytree(ROOT / "autograder", source / "autograder", ignore=shutil.ignore_patterns("__pycache__"))
        self.folder = folder / "venv"
        quiet = ("--quiet", "--python")
        build = ("build", "--wheel", "--no-build-isolation")
        self.uv(*build, *quiet, sys.executable, "--out-dir", folder, source)
        self.uv("venv", *quiet, python, self.folder)
        # The dependencies come from this environment, as hard links: no network, and no second copy on the disk. The
        # sandbox shows an environment's own folder, so a .pth file that leads here would not do.
        for name in ("lib", "share"):  # ROS has its libraries beside Python's packages
            link_tree(Path(sys.prefix, name), self.folder / name)
        next(self.folder.glob("lib/python*/site-packages/autograder.pth")).unlink()
        for program in ("alembic", "jupyter", "jupyter-nbconvert"):
            self.link_program(program)
        wheel = next(folder.glob("*.whl"))
        self.uv("pip", "install", "--quiet", "--no-deps", "--python", self.folder / "bin" / "python", wheel)

    def link_program(self, program: str) -> None:
        """Make a program of this environment one of that environment."""
        text = Path(sys.prefix, "bin", program).read_text(encoding="utf-8")
        script = self.folder / "bin" / program
        script.write_text(text.replace(sys.prefix, str(self.folder)), encoding="utf-8")
        script.chmod(0o755)

    def uv(self, *words: str | Path) -> None:
        """Run uv without the network."""
        program, environ = Path(sys.executable).with_name("uv"), os.environ | {"UV_OFFLINE": "1"}
        done = subprocess.run([program, *words], env=environ, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr

    def run(self, cwd: Path, *words: str | Path, status: int = 0) -> str:
        """Run a command of this environment, and return all that it printed."""
        program, *rest = words
        environ = {name: os.environ[name] for name in ("HOME", "LANG") if name in os.environ}
        done = subprocess.run(
            [self.folder / "bin" / program, *rest],
            cwd=cwd, env=environ | {"PATH": "/usr/bin:/bin"}, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == status, done.stdout + done.stderr
        return done.stdout + done.stderr
