"""Independent work, side by side: a pool of processes, or one task after the other."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from typing import Any


def run_tasks(
    function: Callable[..., Any], tasks: Sequence[tuple[Any, ...]], executor: Executor | None
) -> list[Any]:
    """Results of ``function(*task)`` in order, side by side where there is an executor."""
    if executor is None:
        return [function(*task) for task in tasks]
    return [f.result() for f in [executor.submit(function, *task) for task in tasks]]


@contextmanager
def workers() -> Iterator[Executor]:
    """A process pool of the machine's cores; an interrupt reaches this process only."""
    count = os.cpu_count() or 1
    pool = ProcessPoolExecutor(
        count,
        mp_context=get_context("spawn"),
        initializer=signal.signal,
        initargs=(signal.SIGINT, signal.SIG_IGN),
    )
    try:
        with _interrupts_held():
            for _ in range(count):
                pool.submit(os.getpid)  # starts a process, which inherits the held signal
        yield pool
        pool.shutdown()
    except BaseException:
        for process in list((pool._processes or {}).values()):
            process.terminate()
        pool.shutdown(wait=False, cancel_futures=True)
        raise


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Ctrl-C waits: it would hit processes that cannot ignore it yet, and they would say so."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
