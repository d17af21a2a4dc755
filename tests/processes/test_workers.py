"""Protects the waits for tasks of workers on systems whose waits differ: a fake of Windows."""

import time
from concurrent.futures import Future

import pytest

from rbstab.processes import workers
from rbstab.processes.workers import waited


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
