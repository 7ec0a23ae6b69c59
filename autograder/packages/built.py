"""What came of building a package, and where what it installs lies."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class Built:
    """What came of building a package."""

    name: str
    status: int
    """Of colcon."""
    log: str
    over: str = ""
    """What it took too much of, and was ended for, such as `memory`."""
    files: frozenset[str] = field(default_factory=frozenset)
    """What is installed, as paths below the package's folder in `install`."""
    folder: Path = Path()
    """That folder."""

    @property
    def executables(self) -> list[str]:
        """Names that `ros2 run` finds: it looks for files in `lib/PACKAGE`."""
        where = f"lib/{self.name}"
        return sorted(Path(path).name for path in self.files if str(Path(path).parent) == where)

    def shared(self, name: str) -> str:
        """Where below `share/PACKAGE` a file of this name is, as `ros2 launch` looks for it; the name if nowhere."""
        where = f"share/{self.name}/"
        found = sorted(path for path in self.files if path.startswith(where) and Path(path).name == name)
        return found[0].removeprefix(where) if found else name

    def text(self, path: str) -> str:
        """Return an installed file as text; empty if there is none."""
        return (self.folder / path).read_text("utf-8", "replace") if path in self.files else ""
