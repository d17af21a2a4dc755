"""Protects worker processes: their setup, and waits for them on systems whose waits differ."""

import os
import signal
import time
from concurrent.futures import Future

import pytest

from rbstab.processes import workers
from rbstab.processes.workers import waited, worker_pool


def test_a_wait_ends_again_and_again(monkeypatch):
    """Python on Windows looks for interrupts only between waits."""
    task: Future[str] = Future()
    waits: list[float] = []

    def wait(futures, timeout=None):
        assert futures == [task]
        waits.append(timeout)
        if len(waits) == 3:
            task.set_result("done")

    monkeypatch.setattr(workers, "wait", wait)
    assert waited(task) == "done"
    assert len(waits) == 3
    assert all(0 < timeout < 1 for timeout in waits)


def test_the_error_of_a_task_is_raised():
    task: Future[None] = Future()
    task.set_exception(ZeroDivisionError("its error"))
    begin = time.monotonic()
    with pytest.raises(ZeroDivisionError, match="its error"):
        waited(task)
    assert time.monotonic() - begin < 10.0


def remember(word: str) -> None:
    os.environ["RBSTAB_REMEMBERED"] = word


def state_of_worker() -> tuple[str | None, list[object]]:
    handlers: list[object] = [
        signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)
    ]
    return os.environ.get("RBSTAB_REMEMBERED"), handlers


def test_workers_are_set_up_before_their_first_task_and_ignore_interrupts():
    with worker_pool(1, remember, "set up") as pool:
        word, handlers = waited(pool.submit(state_of_worker))
    assert word == "set up"
    assert handlers == [signal.SIG_IGN, signal.SIG_IGN]
    assert "RBSTAB_REMEMBERED" not in os.environ
