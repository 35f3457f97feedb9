"""Jobs on a Dask cluster: an executor whose workers must run the same code."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future
from contextlib import contextmanager
from typing import Any

from walking_irl.errors import InvalidInputError, WalkingIRLError
from walking_irl.experiments.runner import code_digest
from walking_irl.versions import versions

CONNECT = 10.0
"""How long a scheduler may take to answer [s]."""
FIRST_WORKER = 60.0
"""How long the first worker may take to join [s]."""


class ClusterError(WalkingIRLError):
    """The cluster was lost on the way, or a job kills its workers."""


def software() -> dict[str, str]:
    """What must be the same here and on every worker."""
    return {"walking-irl's code": code_digest()[:12], **versions()}


def run_there(here: dict[str, str], function: Callable[..., Any], *args: Any) -> Any:
    """Call a function on a worker.

    Raises:
        InvalidInputError: If the worker has other versions: results would not be the same.
    """
    there = software()
    other = [f"{name} {there.get(name)} instead of {here[name]}" for name in here
             if there.get(name) != here[name]]  # fmt: skip
    if other:
        raise InvalidInputError(f"a worker of the cluster has {', '.join(other)}; install the same")
    return function(*args)


class Cluster(Executor):
    """An executor over a ``distributed.Client``; jobs of a worker that dies go to another one."""

    def __init__(self, client: Any) -> None:
        self.client = client
        self.executor = client.get_executor(pure=False)  # equal jobs of two studies are two

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Run ``fn(*args)`` on a worker."""
        future: Future[Any] = self.executor.submit(run_there, software(), fn, *args, **kwargs)
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Wait for the jobs, or give them up."""
        self.executor.shutdown(wait=wait and not cancel_futures)


@contextmanager
def cluster(address: str) -> Iterator[Executor]:
    """The workers of a scheduler.

    Args:
        address: For example ``tcp://192.168.0.5:8786``.

    Raises:
        InvalidInputError: If ``distributed`` is not installed, or no scheduler or worker is there.
        ClusterError: If they are lost on the way; what was done is kept by whoever kept it.
    """
    try:
        from distributed import Client, KilledWorker
    except ImportError as error:
        raise InvalidInputError(
            "--scheduler needs the package distributed: pip install 'walking-irl[cluster]'"
        ) from error
    connect: Any = Client  # untyped
    with _unsaid():
        yield from _connected(connect, address, KilledWorker)


def _connected(connect: Any, address: str, killed: type[Exception]) -> Iterator[Executor]:
    try:
        client: Any = connect(address, timeout=CONNECT, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InvalidInputError(
            f"no Dask scheduler answers at {address}; start one with dask scheduler, and give the "
            "address that it prints"
        ) from error
    pool = Cluster(client)
    try:
        _await_worker(client, address)
        yield pool
    except killed as error:
        raise ClusterError(f"a job killed every worker that took it: {error}") from error
    except CancelledError as error:
        raise ClusterError(
            f"the scheduler {address} was lost; finished jobs are kept, and the same command goes "
            "on from there"
        ) from error
    finally:
        pool.shutdown(wait=False)
        client.close(timeout=CONNECT)


@contextmanager
def _unsaid() -> Iterator[None]:
    """What ``distributed`` logs is told in one sentence instead."""
    names = [n for n in logging.root.manager.loggerDict if n.split(".")[0] == "distributed"]
    levels = {name: logging.getLogger(name).level for name in names}
    for name in names:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for name, level in levels.items():
            logging.getLogger(name).setLevel(level)


def _await_worker(client: Any, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=FIRST_WORKER)
    except TimeoutError as error:
        raise InvalidInputError(
            f"no worker has joined the scheduler: start some with dask worker {address} "
            "--nworkers 4 --nthreads 1"
        ) from error
