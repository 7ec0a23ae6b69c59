"""Build packages of interfaces, each only once for all students who hand in the same files.

A build takes ten seconds of CPU time, and many students hand in the same interfaces. The result of a build depends only
on the files, because it runs in a sandbox that contains nothing else, and no student's program runs in that sandbox
before or during the build. A result is kept under a digest of the files and is used again only for the same files;
`kept_builds` keeps it for later runs, too.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from concurrent.futures import ThreadPoolExecutor

from pydantic import BaseModel, ConfigDict, ValidationError

from autograder.core.results import Isolation
from autograder.grading import kept_builds
from autograder.grading.job import Job
from autograder.packages.workspace import digest_of, missing_tools
from autograder.sandbox.build import BUILD_SECONDS, BuildRun
from autograder.sandbox.grading_sandbox import run_in_sandbox

_BUILDS = 3
"""The number of attempts if a build fails for an unknown reason; see `autograder.packages.fair_build`."""
_STARTING = 30.0
"""Seconds that the sandbox itself may take in addition to the builds."""


class Sources(BaseModel):
    """The input of the process that builds a package."""

    model_config = ConfigDict(extra="forbid")
    package: str
    files: dict[str, str]
    """The text of each file, by its path in the package."""
    isolation: Isolation

    @property
    def digest(self) -> str:
        """The digest of the package, which identifies its build."""
        return digest_of(self.package, {path: text.encode() for path, text in self.files.items()})


_kept: OrderedDict[str, BuildRun] = OrderedDict()
_building: dict[str, threading.Lock] = {}
_lock = threading.Lock()


def with_interfaces(job: Job, at_once: int, stop: threading.Event | None = None) -> Job:
    """Return the job with its packages of interfaces built, those of the reference included.

    If this machine lacks the tools to build packages, return the job unchanged; its checks then report that.

    Args:
        job: the submission.
        at_once: the number of builds that run at the same time.
        stop: an event that ends the builds when it is set.

    Raises:
        Stopped: `stop` was set.
    """
    packages = job.interfaces
    if not packages or missing_tools():
        return job
    all_sources = [Sources(package=name, files=files, isolation=job.isolation) for name, files in packages]
    with ThreadPoolExecutor(at_once, thread_name_prefix="build") as pool:
        runs = pool.map(lambda sources: (sources.digest, _build(sources, stop)), all_sources)
        # If there is no result, the worker builds the package again and reports what happens.
        return job.model_copy(update={"built": {digest: run for digest, run in runs if run is not None}})


def _build(sources: Sources, stop: threading.Event | None) -> BuildRun | None:
    """Return the result of a build; None if the process that builds gave no result."""
    key = f"{sources.digest} {sources.isolation}"
    with _lock:
        alone = _building.setdefault(key, threading.Lock())
    with alone:  # another submission with the same files waits for this build
        known = _kept.get(key)
        if known is not None:
            return known
        found = kept_builds.stored(sources.digest) if sources.isolation is Isolation.FULL else None
        if found is None:
            found = _run(sources, stop)
            if found is not None and sources.isolation is Isolation.FULL:
                kept_builds.store(sources.digest, found)
        # A build that was killed or stopped might succeed later.
        if found is not None and found.status >= 0 and not found.over:
            with _lock:
                _kept[key] = found
                while len(_kept) > kept_builds.KEPT:
                    _building.pop(_kept.popitem(last=False)[0], None)
        return found


def _run(sources: Sources, stop: threading.Event | None) -> BuildRun | None:
    command, limit = ["autograder.grading.builder"], _BUILDS * BUILD_SECONDS + _STARTING
    run = run_in_sandbox(command, sources.model_dump_json().encode(), sources.isolation, limit, stop)
    try:
        return BuildRun.model_validate_json(run.stdout)
    except ValidationError:
        return None
