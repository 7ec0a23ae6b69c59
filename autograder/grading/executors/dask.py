"""Run jobs on an existing Dask cluster: a scheduler, and workers on machines that have exactly the same kit."""

from __future__ import annotations

import hashlib
import logging
import uuid
from collections.abc import Callable, Generator, Sequence
from typing import Any

from autograder.core.errors import KitError
from autograder.core.results import SubmissionResult
from autograder.course.lab import kit_digest
from autograder.grading.job import Job
from autograder.grading.supervisor import run_in_worker, unknown

_SECONDS_TO_ANSWER = 30.0
"""Seconds after which the scheduler must have answered, and again seconds after which it must have a worker."""


class OtherKit(Exception):
    """A worker has a different kit, whose verdicts may be different, or has got a different job."""


class Dask:
    """Sends each job to a free worker. If a worker dies, another worker runs its jobs.

    The cluster decides how many jobs run at the same time: as many as its workers have threads.

    Args:
        address: the address of the scheduler, such as `tcp://grading:8786`.
    """

    def __init__(self, address: str) -> None:
        """Store the address without connecting to it."""
        self._address = address

    def run(self, jobs: Sequence[Job], started: Callable[[str], None]) -> Generator[SubmissionResult, None, None]:
        """Run jobs as described in `Executor.run`. A job that another worker takes over starts again."""
        if not jobs:
            return
        client = self._client()
        try:
            from distributed import as_completed

            kit, begun = kit_digest(), f"autograder {uuid.uuid4()}"
            client.subscribe_topic(begun, lambda event: started(event[1]))
            texts = {job.student: job.model_dump_json() for job in jobs}
            digests = {student: hashlib.sha256(text.encode()).hexdigest() for student, text in texts.items()}
            futures = {
                client.submit(run_there, text, digests[student], kit, begun, pure=False): student
                for student, text in texts.items()
            }
            by_student = {job.student: job for job in jobs}
            for future in as_completed(futures, loop=client.loop):
                yield self._result_of(future, by_student[futures[future]])
        finally:
            client.close()  # this cancels the jobs that have not started

    def _client(self) -> Any:
        try:
            from distributed import Client
        except ImportError as error:
            raise KitError("Sending jobs to Dask needs the package distributed.", "pip install distributed") from error
        for name in ("distributed", "distributed.client", "distributed.core"):
            logging.getLogger(name).setLevel(logging.CRITICAL)  # its errors are reported here as sentences
        try:
            client = Client(self._address, timeout=_SECONDS_TO_ANSWER, set_as_default=False)
        except (OSError, ValueError) as error:
            raise KitError(
                f"No Dask scheduler answers at {self._address}.", "Start one: dask scheduler; dask worker ADDRESS"
            ) from error
        try:
            client.wait_for_workers(1, timeout=_SECONDS_TO_ANSWER)
            kits = client.run(kit_digest, on_error="return")
        except (OSError, TimeoutError) as error:
            client.close()
            raise KitError(
                f"The Dask scheduler at {self._address} has no worker.", "Start: dask worker ADDRESS"
            ) from error
        other = [worker for worker, kit in kits.items() if kit != kit_digest()]
        if other:
            client.close()
            raise KitError(
                f"{len(other)} of {len(kits)} workers have no kit, or a different one: {', '.join(other[:3])}.",
                "Install the same version of the kit there, and start them again.",
            )
        return client

    def _result_of(self, future: Any, job: Job) -> SubmissionResult:
        from distributed import CancelledError

        try:
            return SubmissionResult.model_validate_json(future.result())
        except KitError:
            raise
        except CancelledError as error:
            raise KitError(
                f"The Dask scheduler at {self._address} no longer answers.",
                "Start it, and run the command again: what is finished is kept.",
            ) from error
        except OtherKit as error:
            raise KitError(str(error), "Install the same version of the kit there, and start it again.") from error
        except Exception as error:  # the other submissions must still be graded
            return unknown(job, f"The grading process failed: {type(error).__name__}.", str(error))


def run_there(text: str, digest: str, kit: str, begun: str) -> str:
    """Run one job on a worker of the cluster, and return its result as JSON.

    Args:
        text: the job as JSON, with the submission and the lab's cells.
        digest: the digest of this text, which shows that it arrived unchanged.
        kit: the digest of the kit that must give the verdicts.
        begun: the topic on which the start of the job is announced, with the student's name.

    Raises:
        OtherKit: this machine has a different kit, or got a different job.
    """
    from distributed import get_worker

    if hashlib.sha256(text.encode()).hexdigest() != digest or kit_digest() != kit:
        raise OtherKit(f"The Dask worker at {get_worker().address} has a different kit, or got a different job.")
    job = Job.model_validate_json(text)
    get_worker().log_event(begun, job.student)
    return run_in_worker(job).model_dump_json()
