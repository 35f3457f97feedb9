"""Independent work, side by side: a pool of processes, or one task after the other; interrupts."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import current_process, get_context, parent_process
from multiprocessing.connection import wait
from typing import Any

from walking_irl.errors import InvalidInputError

_heard: list[int] = []
"""Interrupts that were raised while :func:`interrupts_raised`."""


def run_tasks(
    function: Callable[..., Any], tasks: Sequence[tuple[Any, ...]], executor: Executor | None
) -> list[Any]:
    """Results of ``function(*task)`` in order, side by side where there is an executor."""
    if executor is None:
        return [function(*task) for task in tasks]
    return [f.result() for f in [executor.submit(function, *task) for task in tasks]]


def can_be_copied() -> bool:
    """Whether this process may be copied as it is: on Linux, as long as it has one thread."""
    return sys.platform == "linux" and len(os.listdir("/proc/self/task")) == 1


@contextmanager
def workers(*, copied: bool = False) -> Iterator[Executor]:
    """A process pool of the machine's cores; an interrupt reaches this process only.

    The pool's processes end with this one, however it ends.

    Args:
        copied: Whether its processes begin as copies of this one, where that is safe: at once, with
            all that is loaded. Others load everything anew, which takes a second of each.

    Raises:
        InvalidInputError: If its processes cannot start, since they run the caller's script again.
    """
    if getattr(current_process(), "_inheriting", False):  # a new process runs the script
        os._exit(1)  # without 150 lines of stack traces; the parent says it in one sentence
    count = os.cpu_count() or 1
    context = get_context("fork" if copied and can_be_copied() else "spawn")
    pool = ProcessPoolExecutor(count, mp_context=context, initializer=_begin)
    try:
        with _interrupts_blocked():  # each starts a process, which inherits the blocked signal
            started = [pool.submit(os.getpid) for _ in range(count)]
        try:
            yield pool
        except BrokenExecutor as error:
            if any(f.done() and f.exception() is None for f in started):
                raise
            raise InvalidInputError(
                "worker processes could not start; a script that uses them needs its code under "
                'if __name__ == "__main__":, because each of them reads the script'
            ) from error
        pool.shutdown()
    except BaseException:
        for process in list((pool._processes or {}).values()):
            process.terminate()
        pool.shutdown(wait=False, cancel_futures=True)
        raise


def _begin() -> None:
    """In a new process: leave interrupts to the parent, and do not outlive it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # a copy would raise what the parent raises
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    assert parent is not None  # it is a pool's
    wait([parent.sentinel])
    os._exit(1)  # nobody waits for what it does


@contextmanager
def interrupts_raised() -> Iterator[None]:
    """Ctrl-C and SIGTERM, what ``kill`` and batch systems send, raise ``KeyboardInterrupt``."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, _raise) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        with interrupts_kept():
            yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _raise(number: int, frame: Any) -> None:
    _heard.append(number)
    raise KeyboardInterrupt


def interrupts_heard() -> int:
    """How many interrupts have been raised so far while :func:`interrupts_raised`."""
    return len(_heard)


def interrupts_answered() -> None:
    """Whoever ends with what is done says so: errors from here on are errors again."""
    _heard.clear()


@contextmanager
def interrupts_kept() -> Iterator[None]:
    """An interrupt that foreign code has turned into another error is an interrupt all the same.

    NumPy's dtype promotion, for one, raises ``TypeError`` in place of whatever it was hit by.
    """
    before = interrupts_heard()
    try:
        yield
    except Exception as error:
        if interrupts_heard() > before:
            interrupt = KeyboardInterrupt()
            for note in getattr(error, "__notes__", []):  # of what else went wrong since
                interrupt.add_note(note)
            raise interrupt from error
        raise


@contextmanager
def interrupts_held() -> Iterator[None]:
    """Ctrl-C and SIGTERM wait until the block ends; for what must be done as a whole, and is short.

    Handlers of other threads and of other programs stay as they are.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    waiting: list[int] = []
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        for number, handler in before.items():
            if handler is not None and handler is not signal.SIG_IGN:
                signal.signal(number, lambda got, frame: waiting.append(got))
        yield
    finally:
        for number, handler in before.items():
            if handler is not None:
                signal.signal(number, handler)
        if waiting:
            signal.raise_signal(waiting[0])


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Ctrl-C waits: it would hit processes that cannot ignore it yet, and they would say so."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
