"""Runs the pages that have to be run side by side, before Sphinx reads them one after the other.

A page waits for its programs most of the time, so that several of them need hardly longer than one. What has run goes
into MyST-NB's cache, from which MyST-NB takes it when it reads the page.

What does not hold is not cached, and therefore MyST-NB runs that page once more, alone. On a busy machine a program may
come too late for an experiment; a statement that is wrong fails the second time, too, and with it the build.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any

from jupyter_cache import get_cache
from jupyter_cache.base import CacheBundleIn
from jupyter_cache.executors.utils import ExecutionResult, single_nb_execution
from myst_nb.core.read import create_nb_reader
from nbformat import NotebookNode
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment

FOR_EACH_CPU = 3
"""How many pages run at a time: each uses a CPU for about a sixth of its time, and must not wait for one for long."""
STARTS_WITHIN = 300
"""Seconds until a kernel must have started; several of them start together."""


def on_read(app: Sphinx, env: BuildEnvironment, names: list[str]) -> None:
    """Run those of the pages that are about to be read that are not in the cache, the longest first."""
    config = env.mystnb_config
    if config.execution_mode != "cache":
        return
    cache = get_cache(config.execution_cache_path)
    waiting: dict[str, NotebookNode] = {}
    for name, notebook in pages(env, names):
        with suppress(KeyError):
            cache.match_cache_notebook(notebook)
            continue
        waiting[name] = notebook
    order = sorted(waiting, key=lambda name: -len(waiting[name].cells))

    def run(name: str) -> ExecutionResult:
        with tempfile.TemporaryDirectory() as folder:
            return single_nb_execution(
                waiting[name], folder, config.execution_timeout, False, startup_timeout=STARTS_WITHIN
            )

    pool = ThreadPoolExecutor(FOR_EACH_CPU * len(os.sched_getaffinity(0)))
    try:
        for name, result in zip(order, pool.map(run, order), strict=True):
            if result.err is not None:
                print(f"{name} is run once more, because not everything held:\n{result.exc_string}", file=sys.stderr)
                continue
            bundle = CacheBundleIn(result.nb, env.doc2path(name), data={"execution_seconds": result.time})
            cache.cache_notebook_bundle(bundle, check_validity=False, overwrite=True)
    finally:
        pool.shutdown(cancel_futures=True)


def pages(env: BuildEnvironment, names: list[str]) -> Iterator[tuple[str, NotebookNode]]:
    """Return those of the pages that have cells to run, each as MyST-NB will read it."""
    for name in names:
        path = env.doc2path(name)
        text = Path(path).read_text(encoding="utf-8")
        reader = create_nb_reader(path, env.myst_config, env.mystnb_config, text)
        notebook = reader.read(text) if reader else None
        if notebook and any(cell.cell_type == "code" for cell in notebook.cells):
            yield name, notebook


def setup(app: Sphinx) -> dict[str, Any]:
    """Register with Sphinx."""
    app.connect("env-before-read-docs", on_read)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
