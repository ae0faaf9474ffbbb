"""Connects `rayproof run` to a Dask cluster, checks the cluster, and sends it the user's own formulas."""

import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rayproof.reports.commands.usage import UsageError, told_in_one_line
from rayproof.reports.program_name import installing
from rayproof.reports.results.files import legible

if TYPE_CHECKING:
    from rayproof.reports.run.engine.cluster import ClusterAddress
    from rayproof.reports.run.engine.dispatch import Dispatch
    from rayproof.reports.run.options import RunOptions, Source


def scheduler_at(address: str | None, tls: Path | None) -> "ClusterAddress | None":
    """Return the address of the cluster that runs the cases, or None if they run on this machine.

    Raises:
        UsageError: the address or the folder of certificates is invalid, or Dask distributed is not installed.

    """
    if address is None:
        if tls is not None:
            raise UsageError("--tls needs --scheduler")
        return None
    from importlib.util import find_spec

    if find_spec("distributed") is None:
        raise UsageError(f"--scheduler needs Dask distributed, which is not installed: {installing('dask')}")
    from rayproof.reports.run.engine.cluster import ClusterAddress, checked

    with told_in_one_line():
        return checked(ClusterAddress(address=address, tls=tls))


@contextmanager
def engaged(
    place: "ClusterAddress", request: "RunOptions", references: tuple[str, ...], *, jobs: int | None
) -> Iterator["Dispatch"]:
    """Yield a `Dispatch` that distributes the request's cases over the cluster's workers; close it after the block.

    Raises:
        UsageError: the cluster cannot be used, or has no worker.

    """
    from rayproof.reports.run.engine.cluster import reached
    from rayproof.reports.run.engine.dispatch import Dispatch
    from rayproof.reports.run.engine.machine import Batch
    from rayproof.reports.run.options import case_options

    with ExitStack() as stack:
        with told_in_one_line():
            options = replace(case_options(request, references), sources=_sources(request.configurations))
            batch = Batch(options=options, timeout=request.timeout, jobs=jobs, memory=request.worker_memory)
            workers = Dispatch(stack.enter_context(reached(place)), batch, request.out, tell=_tell)
            stack.callback(workers.close)
        yield workers


def _sources(configurations: tuple[str, ...]) -> tuple["Source", ...]:
    """Return the source files of the user's own formulas in configurations; raise ValueError if loading one fails."""
    from rayproof.reports.run.options import Source
    from rayproof.tracer.configuration import Configuration
    from rayproof.tracer.formulas.own_file import is_own, sources

    merged = {}
    for name in filter(is_own, configurations):
        configuration = Configuration.parse(name)
        for slot, variant in configuration.formulas.items():
            if is_own(variant):
                path, files = sources(configuration.formula(slot))
                # Two functions of the same file may import different files from its folder.
                merged[path] = {**merged.get(path, {}), **files}
    return tuple(Source(path=path, files=files) for path, files in merged.items())


def _tell(line: str) -> None:
    sys.stderr.write(f"{legible(line)}\n")
