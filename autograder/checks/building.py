"""`build`: builds a package of the student's, and what a check expects of it."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import NoReturn

from autograder.checks import current, outcomes
from autograder.checks.scoring import Score, part, score
from autograder.graph.names import nearest
from autograder.packages.built import (
    Built,
    InterfaceError,
    imported_interfaces,
    interface_parts,
    why_no_executable,
    why_other_target,
)
from autograder.packages.explain import PACKAGE_XML, needed_packages, not_described, why_not_built
from autograder.packages.workspace import missing_tools
from autograder.reasons import Group, Kind, Reason

PACKAGE_DEPEND = Kind("package-depend", "package.xml does not name a package that the programs need", Group.BUILT)
NO_INTERFACE = Kind("no-interface", "the build installs no interface of this name", Group.BUILT)
NOT_INSTALLED = Kind("not-installed", "the build installs no file at this place", Group.BUILT)
INTERFACE_FIELDS = Kind("interface-fields", "the interface has other fields or types than asked for", Group.BUILT)

_RECORDS = re.compile(r"(egg-info|dist-info|__pycache__|/colcon-core/|/hook/)|(^|/)package\.(d?sv|sh|ps1|bash|zsh)$")
"""Files that colcon, setuptools and Python write for themselves."""


class _Replaced(Exception):
    """The package is not as the rest of the check needs it; the message says why."""


class Package:
    """One package and the result of building it; `with build("car_sensors") as package:` like a launch."""

    def __init__(self, name: str) -> None:
        """Name the package; it is built when the first expectation asks for it."""
        self.name = name
        self._built: Built | None = None
        self._replaceable = False

    def __enter__(self) -> Package:
        current.check.findings.begin_block()
        current.check.use_package(self.name)
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> bool:
        return outcomes.ends_block(error, ran=not missing_tools())

    def part(self, title: str) -> AbstractContextManager[None]:
        """A block whose expectations give points of their own; see `autograder.checks.scoring`.

        Args:
            title: what the part is called in the score and in the report.

        Example:
            `with package.part("it builds"): package.expect_built()`
        """
        return part(title)

    def score(self, points: float | Mapping[str, float]) -> Score:
        """The score of the cell.

        Args:
            points: of the cell, all or nothing; or of each part, by its title.

        Example:
            `package.score({"it builds": 1, "what is installed": 1})`
        """
        return score(points)

    @contextlib.contextmanager
    def or_reference(self) -> Iterator[None]:
        """A block of what the rest of the check needs of the package, which is not what the check is about.

        If something in it does not hold, the lab's own package stands in: launches of this check import from it, and
        nothing fails. In a student's notebook, which has no solution, it fails.

        Example:
            `with package.or_reference(): package.expect_interface("msg/Speed", {"data": "float64"})`
        """
        self._replaceable = current.check.workspace.has_reference(self.name)
        try:
            yield
        except _Replaced as error:
            current.check.workspace.build_reference(self.name)
            current.check.findings.references[self.name] = str(error)
            outcomes.passed(f"A right `{self.name}` stands in for this one", observed=str(error))
        finally:
            self._replaceable = False

    @property
    def log(self) -> str:
        """What the build printed."""
        return self._build().log

    @property
    def installed(self) -> list[str]:
        """What the build installs, as paths below the package's folder in `install`, but for Python's own records.

        Nothing if it failed.
        """
        built = self._build()
        return [] if built.status else sorted(path for path in built.files if not _RECORDS.search(path))

    def expect_built(self, hint: str = "") -> None:
        """`colcon build` builds the package.

        Args:
            hint: a pointer for the student.

        Example:
            `package.expect_built()`

        Codes:
            those of builds.
        """
        self._ready(f"`{self.name}` is built", hint)
        outcomes.passed(f"`{self.name}` is built")

    def expect_depends(self, *packages: str, to_build: Sequence[str] = (), hint: str = "") -> None:
        """package.xml says that the programs need these packages: `<depend>` or `<exec_depend>`.

        It also has to name those whose messages, services or actions a module of the package imports.

        Args:
            packages: such as `rclpy`.
            to_build: those that the build needs: `<buildtool_depend>`, `<build_depend>` or `<depend>`.
            hint: a pointer for the student.

        Example:
            `package.expect_depends("rclpy", "std_msgs")`

        Codes:
            `package-depend`.
        """
        title = f"package.xml names {', '.join(f'`{one}`' for one in packages)} as needed at run time"
        title += f", and {', '.join(f'`{one}`' for one in to_build)} to build it" * bool(to_build)
        sources = current.check.workspace.source(self.name)
        reason = missing_package(self.name) or not_described(sources, self.name)
        if reason is not None:
            self._fail(title, reason, hint)
        at_run, at_build = needed_packages(sources), needed_packages(sources, to_build=True)
        by = {one: f" `{module}` imports it." for one, module in imported_interfaces(sources).items()}
        lacking = next((one for one in (*packages, *by) if one not in (*at_run, self.name)), "")
        if lacking:
            # package.xml is refused if it has <depend> beside <build_depend>, or beside <exec_depend>.
            tag = "depend" if lacking in to_build and lacking not in at_build else "exec_depend"
            self._fail(title, _not_named(lacking, f"at run time.{by.get(lacking, '')}", at_run, tag), hint)
        lacking = next((one for one in to_build if one not in at_build), "")
        if lacking:
            tag = "build_depend" if lacking in (*packages, *by) else "buildtool_depend"
            self._fail(title, _not_named(lacking, "to build it.", at_build, tag), hint)
        outcomes.passed(title)

    def expect_executable(self, name: str, target: str = "", hint: str = "") -> None:
        """`ros2 run` finds an executable of this name: it lies in `lib/PACKAGE`, and leads to a function.

        Args:
            name: of the executable.
            target: the function that it has to lead to, as `module:function`; without it, any that is there.
            hint: a pointer for the student.

        Example:
            `package.expect_executable("speed_sensor")`

        Codes:
            `executable-place`, `entry-point`, `entry-point-target`.
        """
        title = f"`ros2 run {self.name} {name}` finds its program"
        built = self._ready(title, hint)
        reason = why_no_executable(built, name) or why_other_target(built, name, target)
        if reason is not None:
            self._fail(title, reason, hint)
        outcomes.passed(title, observed=f"lib/{self.name}/{name}")

    def expect_installed(self, *paths: str, hint: str = "") -> None:
        """Files are installed, such as `share/car_sensors/package.xml`.

        Args:
            paths: below the package's folder in `install`.
            hint: a pointer for the student.

        Example:
            `package.expect_installed("share/car_sensors/launch/sensors.launch.yaml")`

        Codes:
            `not-installed`.
        """
        for path in paths:
            title = f"`{path}` is installed"
            built = self._ready(title, hint)
            if path not in built.files:
                same = [other for other in sorted(built.files) if other.rsplit("/", 1)[-1] == path.rsplit("/", 1)[-1]]
                because = f"The build installs no `{path}`."
                because += f" A file of that name lies at `{same[0]}`." if same else ""
                self._fail(title, NOT_INSTALLED(because), hint)
            if _by_colcon_alone(path, built.log):
                because = f"setup.py does not install `{path}`. colcon still does it in its place, and warns in its log"
                self._fail(title, NOT_INSTALLED(f"{because} that it will not do so for long."), hint)
            outcomes.passed(title)

    def expect_interface(self, name: str, *parts: Mapping[str, str], hint: str = "") -> None:
        """The package has an interface with these fields, in any order.

        Args:
            name: such as `msg/DetectedObject`.
            parts: for a message its fields, for a service those of request and response, for an action those of goal,
                result and feedback: type by name, as `{"header": "std_msgs/Header"}`.
            hint: a pointer for the student.

        Example:
            `package.expect_interface("srv/Count", {"label": "string"}, {"count": "int32"})`

        Codes:
            `no-interface`, `interface-fields`.
        """
        title = f"`{self.name}/{name}` has the fields that it should"
        built = self._ready(title, hint)
        installed = built.text(f"share/{self.name}/{name}.{name.split('/')[0]}")
        if not installed:
            has = [path.removeprefix(f"share/{self.name}/") for path in sorted(built.files)]
            has = [path for path in has if re.fullmatch(r"(msg/\w+\.msg|srv/\w+\.srv|action/\w+\.action)", path)]
            because = f"The package installs no interface `{name}`; it has: {', '.join(has) or 'none'}."
            near = "rosidl_generate_interfaces in CMakeLists.txt has to name each file."
            self._fail(title, NO_INTERFACE(because, near), hint)
        try:
            found = interface_parts(self.name, name, installed)
        except InterfaceError as error:
            self._fail(title, INTERFACE_FIELDS(str(error)), hint)
        for place, (wanted, have) in enumerate(zip(parts, found, strict=False)):
            wrong = _difference(wanted, have)
            if wrong:
                names = {2: ("request", "response"), 3: ("goal", "result", "feedback")}.get(len(parts), ("",))
                where = f"Its {names[place]}" if names[place] else f"`{name}`"
                self._fail(title, INTERFACE_FIELDS(f"{where} {wrong}"), hint)
        outcomes.passed(title)

    def _build(self) -> Built:
        if self._built is None:
            self._built = current.check.workspace.build(self.name)
        return self._built

    def _ready(self, title: str, hint: str) -> Built:
        """Return the built package. The check, or the part, fails if it was not built."""
        reason = missing_package(self.name)
        if reason is None:
            built = self._build()
            reason = why_not_built(built, current.check.workspace.source(self.name))
            if reason is None:
                return built
        self._fail(title, reason, hint)

    def _fail(self, title: str, reason: Reason, hint: str) -> NoReturn:
        if self._replaceable:
            raise _Replaced(reason.because)
        outcomes.failed(title, replace(reason, hint=hint or reason.hint))


def _not_named(package: str, when: str, named: Sequence[str], tag: str) -> Reason:
    """Say that package.xml lacks a package: when it is needed, what it is needed for, and which tag names it."""
    because = f"package.xml does not name `{package}` as needed {when} For that it names: "
    because += f"{', '.join(f'`{one}`' for one in named) or 'none'}."
    return PACKAGE_DEPEND(because, f"It needs `<{tag}>{package}</{tag}>`.")


def missing_package(name: str) -> Reason | None:
    """Why a package cannot be built at all; None if building it can be tried."""
    if current.check.workspace.source(name).is_dir():
        return None
    first = f"%%file src/{name}/package.xml"
    because = f"There is no package `{name}`: no cell that begins with `{first}` or the like has been run."
    return PACKAGE_XML(because, "Run the cells of the package first.")


def why_no_package(name: str) -> Reason | None:
    """Build a package, and return why that failed; None if it worked."""
    current.check.use_package(name)
    if name in current.check.findings.references:
        return None
    space = current.check.workspace
    return missing_package(name) or why_not_built(space.build(name), space.source(name))


def why_not_found(package: str, name: str) -> Reason | None:
    """Why a package that is built has no executable of a name; None if it has."""
    return why_no_executable(current.check.workspace.build(package), name)


def _by_colcon_alone(path: str, log: str) -> bool:
    """Whether a file was installed only because colcon adds what setup.py left out, as its log says."""
    said = (
        "install the 'package.xml' file" if path.endswith("/package.xml") else "install a marker in the package index"
    )
    marked = path.endswith("/package.xml") or "/resource_index/packages/" in path
    return marked and f"doesn't explicitly {said}" in " ".join(log.split())


def build(package: str) -> Package:
    """Build one of the student's packages with colcon, if its sources have changed since the last build.

    Args:
        package: the name of its folder below `src`.
    """
    return Package(package)


def _difference(wanted: Mapping[str, str], have: Mapping[str, str]) -> str:
    """What is wrong with the fields of one part; empty if nothing is."""
    for name, kind in wanted.items():
        if name not in have:
            near = nearest(name, have.keys() - wanted.keys())
            return f"has no field `{name}`" + (f"; is `{near}` meant to be it?" if near else ".")
        if have[name] != kind:
            return f"has the field `{name}` as `{have[name]}`, not as `{kind}`."
    more = sorted(have.keys() - wanted.keys())
    return f"has one field more than it should: `{more[0]}`." if more else ""
