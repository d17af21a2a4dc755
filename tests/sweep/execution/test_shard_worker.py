"""Protects the worker processes of a sweep: they store the same shards, even if a process fails."""

import errno
import functools
import os
import signal
import subprocess
import sys
import threading
import time
from itertools import islice
from pathlib import Path

import psutil
import pytest
from support.sweeping import Listener, digest_of, run_sweep
from support.sweeps import FakeEngine, plan_of, plan_with_traces, shard_files

import rbstab.sweep.execution.compute_shard
import rbstab.sweep.folder.sweep_folder
from rbstab.processes.workers import WorkerDiedError
from rbstab.store.errors import StoreError
from rbstab.sweep.execution.events import EngineFailed, Rescheduled, ShardDone
from rbstab.sweep.execution.shard_worker import ShardWorker
from rbstab.sweep.execution.thread_executor import ThreadExecutor
from rbstab.sweep.members.engine import EngineError

pytestmark = pytest.mark.slow

SLOW = functools.partial(FakeEngine, delay=5e-3)


class LostEngine(FakeEngine):
    """An engine that ends its process, as the system does when memory is short."""

    def compute(self, start, stop):
        if start >= 30:
            os._exit(9)
        return super().compute(start, stop)


def slow_to_start(plan):
    time.sleep(60)
    return FakeEngine(plan)


def no_engine(plan):
    raise ZeroDivisionError("cannot be made")


class ThreadAndWorker:
    """An executor of one thread and one worker process; the thread waits until the worker is ready.

    This way both compute shards, however long the worker takes to start.
    """

    def __init__(self, factory, here=FakeEngine, process=ShardWorker):
        self.begin = functools.partial(process, factory=factory)
        self.processes = []
        self.threads = ThreadExecutor(lambda plan: self._here(here, plan), 2, self._elsewhere)
        self.events = self.threads.events

    def _elsewhere(self, plan):
        self.processes.append(self.begin(plan))
        return self.processes[-1]

    def _here(self, here, plan):
        wait_for(lambda: self.processes and self.processes[0]._ready, 30)
        return here(plan)


def wait_for(condition, seconds):
    """Wait until a condition holds, but not longer than `seconds`."""
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.01)


def sweep_with_worker(path, plan, factory, **options):
    """Run a sweep by a thread and a worker; check that the worker ended; return the listener."""
    listener = Listener()
    executor = ThreadAndWorker(factory, **options)
    done = run_sweep(path, plan, listener, executor=executor, shard_size=10)
    assert done.finished
    assert not any(process._worker._process.is_alive() for process in executor.processes)
    return listener


@pytest.mark.parametrize("keep", ["summary", "traces"])
def test_a_process_stores_what_a_thread_stores(tmp_path, keep):
    plan = plan_with_traces(200, keep)
    run_sweep(tmp_path / "a", plan, threads=1)
    elsewhere = []

    class Counted(ShardWorker):
        def compute(self, folder, number):
            elsewhere.append(number)
            return super().compute(folder, number)

    executor = ThreadAndWorker(SLOW, SLOW, process=Counted)
    assert run_sweep(tmp_path / "b", plan, executor=executor, shard_size=10).finished
    assert 0 < len(elsewhere) < 20
    for kind in ("shards", "traces"):
        assert shard_files(tmp_path / "a", kind) == shard_files(tmp_path / "b", kind)
    assert digest_of(tmp_path / "a") == digest_of(tmp_path / "b")


def test_the_shard_of_a_process_that_dies_is_computed_here(tmp_path):
    plan = plan_of(60)
    run_sweep(tmp_path / "a", plan)
    listener = sweep_with_worker(tmp_path / "b", plan, LostEngine, here=SLOW)
    (lost,) = listener.of(Rescheduled)
    assert lost.start >= 30
    assert lost.here
    assert "exit code 9" in str(lost.error)
    assert listener.computed == list(range(6))
    assert digest_of(tmp_path / "a") == digest_of(tmp_path / "b")


def out_of_memory(plan):
    def no_memory(*_):
        raise MemoryError("made up")

    # This replaces it in the worker process alone, which then cannot even rerun single members.
    rbstab.sweep.execution.compute_shard.compute_members = no_memory
    return FakeEngine(plan)


def test_a_shard_that_cannot_be_computed_there_is_computed_here(tmp_path):
    listener = sweep_with_worker(tmp_path / "a", plan_of(60), out_of_memory, here=SLOW)
    (lost,) = listener.of(Rescheduled)
    assert lost.here
    assert str(lost.error) == "MemoryError: made up"
    assert listener.computed == list(range(6))


def test_an_error_over_there_is_told_and_ends_nothing(tmp_path):
    raising = functools.partial(FakeEngine, raising=range(60))
    listener = sweep_with_worker(tmp_path / "a", plan_with_traces(20), raising, here=SLOW)
    failures = listener.of(EngineFailed)
    assert failures
    assert {str(failure.error) for failure in failures} == {"ZeroDivisionError: made up"}
    assert sum(event.members for event in listener.of(ShardDone)) == 20


def full_disk(plan):
    def full(*_):
        raise StoreError("a.npy cannot be written: No space left on device")

    # This replaces it in the worker process alone.
    vars(rbstab.sweep.folder.sweep_folder)["write_shard"] = full
    return FakeEngine(plan)


def test_a_full_disk_over_there_stops_the_sweep(tmp_path):
    with pytest.raises(StoreError, match="No space left"):
        sweep_with_worker(tmp_path / "a", plan_of(60), full_disk, here=SLOW)
    assert run_sweep(tmp_path / "a").finished


def test_a_failed_member_over_there_stops_where_that_is_wanted(tmp_path):
    failing = functools.partial(FakeEngine, failing=range(3000))
    executor, listener = ThreadAndWorker(failing, SLOW), Listener()
    done = run_sweep(
        tmp_path / "a", plan_of(3000), listener, executor=executor, shard_size=10, fail_fast=True
    )
    assert not done.finished
    assert len(listener.computed) < 100
    assert done.inventory.first_failed is not None


@pytest.mark.parametrize("where", ["there", "start"])
def test_without_a_process_all_is_done_here(tmp_path, monkeypatch, where):
    plan = plan_of(60)
    if where == "start":

        def refuse(*_):
            raise OSError(errno.EAGAIN, "Resource temporarily unavailable")

        monkeypatch.setattr("loky.backend.process.LokyProcess.start", refuse)
        with pytest.raises(WorkerDiedError, match="unavailable"):
            ShardWorker(plan, FakeEngine)
    else:
        engine = ShardWorker(plan, no_engine)
        with pytest.raises(EngineError, match="ZeroDivisionError: cannot be made"):
            engine.ready(30)
    threads = ThreadExecutor(SLOW, 3, lambda plan: ShardWorker(plan, no_engine))
    run_sweep(tmp_path / "a", plan)
    assert run_sweep(tmp_path / "b", plan, executor=threads).finished
    assert digest_of(tmp_path / "a") == digest_of(tmp_path / "b")


def test_no_shard_waits_for_a_process_to_begin(tmp_path):
    before = running()
    listener = Listener()
    threads = ThreadExecutor(FakeEngine, 2, lambda plan: ShardWorker(plan, slow_to_start))
    assert run_sweep(tmp_path / "a", plan_of(60), listener, executor=threads).finished
    assert listener.computed == list(range(6))
    wait_for(lambda: not started_since(before), 5)
    assert not started_since(before)


@pytest.fixture
def ignored_sigterm():
    """Ignore SIGTERM, as a job script with `trap '' TERM` does."""
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    yield
    signal.signal(signal.SIGTERM, before)


@pytest.mark.skipif(os.name != "posix", reason="no such signal here")
@pytest.mark.parametrize("ready", [True, False])
def test_a_process_ends_where_nobody_heeds_the_signal(ignored_sigterm, ready):
    before = running()
    process = ShardWorker(plan_of(60), FakeEngine)
    if ready:
        assert process.ready(30)
    closing = threading.Thread(target=process.close, daemon=True)
    closing.start()
    closing.join(30)
    left = started_since(before)
    for other in left:
        other.kill()
    assert not left


def running(parent=None):
    """Return the running worker processes that a process has started."""
    children = psutil.Process(parent).children(recursive=True)
    return [child for child in children if "popen_loky" in " ".join(command(child))]


def started_since(before):
    """Return the running worker processes of this process that are not in a list.

    A reader of results that an earlier test has started may still run.
    """
    return [process for process in running() if process not in before]


def command(process):
    try:
        return process.cmdline()
    except psutil.Error:
        return []


SWEEPER = """
import sys
from pathlib import Path
from support.sweeps import plan_of
from test_shard_worker import SLOW, ThreadAndWorker
from rbstab.sweep.sweep import SweepOptions, sweep_to_folder
options = SweepOptions(executor=ThreadAndWorker(SLOW, SLOW), shard_size=10)
sweep_to_folder(plan_of(3000), Path(sys.argv[1]), options, lambda event: print(event, flush=True))
"""


@pytest.fixture
def sweeper(tmp_path):
    """A process that runs a sweep with a worker and has stored a shard."""
    here, tests = Path(__file__).parent, Path(__file__).parents[2]
    with subprocess.Popen(
        [sys.executable, "-c", SWEEPER, str(tmp_path / "a")],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": f"{here}{os.pathsep}{tests}"},
        start_new_session=True,
    ) as process:
        assert process.stdout is not None
        while "ShardDone" not in process.stdout.readline():
            pass
        yield process
        process.kill()


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="nothing is killed like that here")
def test_a_process_does_not_outlive_its_parent(sweeper):
    (other,) = running(sweeper.pid)
    sweeper.kill()
    other.wait(5)


@pytest.mark.skipif(os.name != "posix", reason="no terminal interrupts like that here")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_to_all_processes_is_not_for_it(sweeper, number):
    """A terminal sends interrupts to all processes, and a job system SIGTERM."""
    (other,) = running(sweeper.pid)
    other.send_signal(number)
    # None is printed when no shard is done for a while.
    lines = (line for line in sweeper.stdout if line != "None\n")
    assert all("ShardDone" in line for line in islice(lines, 10))
    assert other.is_running()
    assert other.status() != psutil.STATUS_ZOMBIE
