"""Where many independent jobs run: on this machine's cores, or on a Dask cluster."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import Any

from walking_irl.domains.contract import Domain
from walking_irl.workers import workers


def add_scheduler(group: Any) -> None:
    """Argument that names a scheduler."""
    group.add_argument(
        "--scheduler",
        metavar="tcp://HOST:PORT",
        help="run on the workers of that Dask scheduler, not on this machine's cores",
    )


def workers_for(domain: Domain) -> AbstractContextManager[Executor | None]:
    """Worker processes, or none where a domain's solves take less time than to start them."""
    return workers(copied=True) if domain.defaults.needs_workers else nullcontext()


@contextmanager
def side_by_side(scheduler: str | None) -> Iterator[Executor]:
    """An executor.

    Raises:
        InvalidInputError: If there is no such scheduler, or what it needs is not installed.
    """
    if scheduler is None:
        with workers(copied=True) as executor:
            yield executor
        return
    from walking_irl.experiments.cluster import cluster

    with cluster(scheduler) as executor:
        yield executor
