"""Builds packages of interfaces, each once for everybody who hands in the same files.

A build takes ten seconds of CPU, and many students hand in the same interfaces. What a build comes to depends on
nothing but the files: it runs in a sandbox that is given them alone, in which no program of a student's runs before or
beside it, and it is known by a digest of them. So it may be used again for the same files, and for no others.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from concurrent.futures import ThreadPoolExecutor

from pydantic import BaseModel, ConfigDict, ValidationError

from autograder.core.results import Isolation
from autograder.grading.job import Job
from autograder.packages.workspace import digest_of, missing_tools
from autograder.sandbox.build import BUILD_SECONDS, BuildRun
from autograder.sandbox.grading_sandbox import run_in_sandbox

KEPT = 32
"""Builds that are kept; one of four interfaces has about 2 MiB."""
_BUILDS = 3
"""As often something is built where a build fails and it is not known why; see `autograder.packages.fair_build`."""
_STARTING = 30.0
"""Seconds that the sandbox around a build may take besides."""


class Sources(BaseModel):
    """One package, as the process that builds it is given it."""

    model_config = ConfigDict(extra="forbid")
    package: str
    files: dict[str, str]
    """Text by path in the package."""
    isolation: Isolation

    @property
    def digest(self) -> str:
        """By which its build is known."""
        return digest_of(self.package, {path: text.encode() for path, text in self.files.items()})


_kept: OrderedDict[str, BuildRun] = OrderedDict()
_building: dict[str, threading.Lock] = {}
_lock = threading.Lock()


def with_interfaces(job: Job, at_once: int, stop: threading.Event | None = None) -> Job:
    """Return the job with its packages of interfaces built, unless this machine cannot: then its checks say so.

    Args:
        job: the submission.
        at_once: builds that run at the same time.
        stop: when it is set, they are ended.

    Raises:
        Stopped: by `stop`.
    """
    packages = job.interfaces
    if not packages or missing_tools():
        return job
    all_sources = [Sources(package=name, files=files, isolation=job.isolation) for name, files in packages.items()]
    with ThreadPoolExecutor(at_once, thread_name_prefix="build") as pool:
        runs = pool.map(lambda sources: (sources.digest, _build(sources, stop)), all_sources)
        # Without a result, the worker tries again, and says what it comes to.
        return job.model_copy(update={"built": {digest: run for digest, run in runs if run is not None}})


def _build(sources: Sources, stop: threading.Event | None) -> BuildRun | None:
    """What building comes to; None if the process that builds gave no result."""
    key = f"{sources.digest} {sources.isolation}"
    with _lock:
        alone = _building.setdefault(key, threading.Lock())
    with alone:  # who hands in the same waits for the one build
        known = _kept.get(key)
        if known is not None:
            return known
        command, limit = ["autograder.grading.builder"], _BUILDS * BUILD_SECONDS + _STARTING
        run = run_in_sandbox(command, sources.model_dump_json().encode(), sources.isolation, limit, stop)
        try:
            found = BuildRun.model_validate_json(run.stdout)
        except ValidationError:
            return None
        with _lock:
            if found.status >= 0 and not found.over:  # what was ended might do better on another day
                _kept[key] = found
                while len(_kept) > KEPT:
                    _building.pop(_kept.popitem(last=False)[0], None)
        return found
