"""A student's launch file, and what of the course's stands in for a part of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from autograder.checks import current
from autograder.checks.program import Program
from autograder.launch_files import declared_arguments, read_launch_file
from autograder.packages.built import Built


@dataclass(frozen=True)
class LaunchFile:
    """What is read, and with what words."""

    name: str
    arguments: Mapping[str, str]
    package: str
    """The package that the student's programs are said to be in."""
    stand_ins: Mapping[str, Program]
    """The course's own program in place of the one that the file names."""
    includes: Mapping[str, str]
    """The course's own launch file in place of the one that the file includes."""
    namespace: str
    """As if another file included this one after `push_ros_namespace`."""

    def packages(self) -> list[str]:
        """The package, if the student writes it as one that is built."""
        return [self.package] if current.check.workspace.source(self.package).is_dir() else []

    def nodes(self) -> list[Program]:
        """What the file starts.

        Raises:
            Refused: it cannot be read.
        """
        built, home = self._built(), current.check.folder.resolve()
        folder = self._folder()

        def find(wanted: str) -> Path:
            if wanted != self.package:
                raise KeyError(wanted)
            return folder

        programs = set(built.executables if built else self.stand_ins) or {path.stem for path in folder.glob("*.py")}
        current.check.use(self.name)
        found = read_launch_file(self._path(), self.arguments, find, programs, self.includes, self.namespace)
        return [
            self._stand_in(
                Program(
                    one.program,
                    package=self.package if built else "",
                    ros_arguments=_seen_from(home, one.model_copy(update={"folder": home}).ros_arguments()),
                    arguments_of_its_own=one.arguments,
                    environment=one.environment,
                    warnings=one.warnings,
                )
            )
            for one in found
        ]

    def unused(self) -> list[str]:
        """The given arguments that the file does not declare, which `ros2 launch` passes over."""
        declared = declared_arguments(self._path())
        return [name for name in self.arguments if name not in declared]

    def _built(self) -> Built | None:
        return current.check.workspace.build(self.package) if self.packages() else None

    def _folder(self) -> Path:
        """The folder of the package's files: the installed one, if the package is built."""
        built = self._built()
        return built.folder.resolve() / "share" / self.package if built else current.check.folder.resolve()

    def _path(self) -> Path:
        built = self._built()
        return self._folder() / (built.shared(self.name) if built else self.name)

    def _stand_in(self, node: Program) -> Program:
        """The course's own program in place of the student's, if the check has one, started with the same words."""
        course = self.stand_ins.get(node.program)
        if course is None:
            return node
        own = [*course.arguments_of_its_own, *node.arguments_of_its_own]
        return replace(node, program=course.program, arguments_of_its_own=own)


def _seen_from(home: Path, words: list[str]) -> list[str]:
    """The words with paths as the programs see them, which run in that folder."""
    return [word.removeprefix(f"{home}/") for word in words]
