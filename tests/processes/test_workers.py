"""Protects worker processes: their setup, and waits for them on systems whose waits differ."""

import os
import signal
from concurrent.futures import Future
from contextlib import nullcontext
from types import SimpleNamespace

import pytest

from rbstab.processes import workers
from rbstab.processes.workers import worked, worker_pool


class Task(Future[str]):
    """A task that ends at the third look at it."""

    def __init__(self) -> None:
        super().__init__()
        self.waits: list[float] = []

    def waited(self, futures, timeout):
        assert futures == [self]
        self.waits.append(timeout)
        if len(self.waits) == 3:
            self.set_result("done")


def test_a_wait_ends_again_and_again(monkeypatch):
    """Python on Windows looks for interrupts only between waits."""
    task = Task()
    monkeypatch.setattr(workers, "wait", task.waited)
    pool = SimpleNamespace(submit=lambda *_: task)
    monkeypatch.setattr(workers, "worker_pool", lambda *_: nullcontext(pool))
    results = worked(str, ["a"], str, workers=2, may_begin=lambda: True, is_given_up=lambda: False)
    assert list(results) == [("a", "done")]
    assert len(task.waits) == 3
    assert all(0 < timeout < 1 for timeout in task.waits)


@pytest.mark.parametrize("workers_", [1, 2])
def test_the_error_of_a_task_is_raised(workers_):
    results = worked(
        int,
        ["1", "x"],
        str,
        workers=workers_,
        may_begin=lambda: True,
        is_given_up=lambda: False,
    )
    assert next(results) == ("1", 1)
    with pytest.raises(ValueError, match="invalid literal"):
        next(results)


def remember(word):
    os.environ["RBSTAB_REMEMBERED"] = word


def state_of_worker():
    handlers: list[object] = [
        signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)
    ]
    return os.environ.get("RBSTAB_REMEMBERED"), handlers


def test_workers_are_set_up_before_their_first_task_and_ignore_interrupts():
    with worker_pool(1, remember, "set up") as pool:
        word, handlers = pool.submit(state_of_worker).result()
    assert word == "set up"
    assert handlers == [signal.SIG_IGN, signal.SIG_IGN]
    assert "RBSTAB_REMEMBERED" not in os.environ
