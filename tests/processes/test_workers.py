"""Protects the waits for workers on systems whose pipes and waits differ: fakes of Windows."""

import time
from concurrent.futures import Future
from multiprocessing.connection import Connection

import pytest
from support.isolated_calls import crash_at_once, serve_doubles, serve_errors

from rbstab.processes import workers
from rbstab.processes.workers import Worker, WorkerDiedError, waited


def poll_of_windows(monkeypatch):
    """Let `poll` raise an error if the other end of the pipe is closed and nothing is left."""
    poll, recv = Connection.poll, Connection.recv

    def polled(self, timeout=0.0):
        if not poll(self, timeout):
            return False
        try:
            answers.append(recv(self))
        except EOFError as error:
            raise BrokenPipeError(109, "The pipe has been ended") from error
        return True

    def received(self):
        return answers.pop() if answers else recv(self)

    answers = []
    monkeypatch.setattr(Connection, "poll", polled)
    monkeypatch.setattr(Connection, "recv", received)


def test_the_end_of_a_worker_is_an_answer(monkeypatch):
    poll_of_windows(monkeypatch)
    worker = Worker(crash_at_once)
    assert worker.has_answer(60.0)
    with pytest.raises(WorkerDiedError):
        worker.receive()


def test_answers(monkeypatch):
    poll_of_windows(monkeypatch)
    worker = Worker(serve_doubles)
    try:
        assert not worker.has_answer(0.0)
        worker.send(21)
        assert worker.has_answer(60.0)
        assert worker.receive() == 42
    finally:
        worker.close()


def test_an_exception_that_a_worker_sends_is_raised():
    worker = Worker(serve_errors)
    try:
        worker.send("the answer")
        with pytest.raises(LookupError, match="the answer"):
            worker.receive()
    finally:
        worker.close()


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
