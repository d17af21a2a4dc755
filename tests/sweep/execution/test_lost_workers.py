"""Protects sweeps whose workers die: no member is lost, and only the one that kills is given up."""

import functools
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor, Future
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
from support.sweeping import Listener, digest_of, run_sweep
from support.sweeps import FakeEngine, plan_of, plan_with_traces, shard_files

from rbstab.store.errors import StoreError
from rbstab.sweep.execution.computing import ExecutorError
from rbstab.sweep.execution.computing import digest_of as digest_of_columns
from rbstab.sweep.execution.events import ShardDone, Warned
from rbstab.sweep.execution.pools import Pool, Processes, Threads
from rbstab.sweep.execution.run import ShardRun
from rbstab.sweep.folder.open_folder import open_folder
from rbstab.sweep.folder.shard_inventory import shard_inventory
from rbstab.sweep.folder.sweep_table import read_sweep

pytestmark = pytest.mark.slow

SLOW = functools.partial(FakeEngine, delay=5e-3)


class Deadly(FakeEngine):
    """An engine that ends its process at some members, or once if there is a file."""

    def __init__(self, plan, deadly=(), once=None):
        super().__init__(plan)
        self.deadly, self.once = deadly, once

    def compute(self, start, stop):
        if any(start <= member < stop for member in self.deadly):
            if self.once is None:
                os._exit(9)
            if self.once.exists():
                self.once.unlink()
                os.kill(os.getpid(), signal.SIGKILL)
        return super().compute(start, stop)


class Forgetful(Executor):
    """An executor that computes at once, but loses members by an error of its own."""

    def __init__(self, lost, error):
        self.lost, self.error = lost, error

    def submit(self, function, /, *args, **_):
        start, stop = args
        future: Future[Any] = Future()
        if any(start <= member < stop for member in self.lost):
            future.set_exception(self.error)
        else:
            future.set_result(function(start, stop))
        return future


class Careless(Executor):
    """An executor that flips one bit of the first result."""

    def __init__(self):
        self.flips = 1

    def submit(self, function, /, *args, **_):
        future: Future[Any] = Future()
        computed = function(*args)
        if self.flips:
            self.flips -= 1
            computed.shard.outcome["lyapunov_end"].view(np.uint8)[-8] ^= 1
        future.set_result(computed)
        return future


def statuses(path):
    return read_sweep(path / "members.h5").words("status").tolist()


@pytest.mark.heavy
def test_a_member_that_always_crashes_is_given_up_alone(tmp_path):
    """Its workers are lost, and others with them; all other members keep their bits."""
    plan, listener = plan_with_traces(30), Listener()
    factory = functools.partial(Deadly, deadly=[13])
    done = run_sweep(tmp_path / "a", plan, listener, factory, pool=Processes(2))
    assert done.finished
    assert done.inventory.first_failed == 13
    run_sweep(tmp_path / "b", plan)
    tables = [read_sweep(tmp_path / name / "members.h5") for name in "ab"]
    others = [member for member in range(30) if member != 13]
    for name in tables[1].columns:
        actual, expected = (table[name][others] for table in tables)
        assert actual.tobytes() == expected.tobytes(), name
    assert tables[0].words("status")[13] == "crashed"
    given_up = [event.text for event in listener.of(Warned) if "given up" in event.text]
    assert [text.startswith("member 13 was given up (") for text in given_up] == [True]
    # Only the member's own shard was halved.
    assert not {k for k in listener.computed if listener.computed.count(k) > 1}
    assert run_sweep(tmp_path / "a", plan, retry_failed=True).finished
    for kind in ("shards", "traces"):
        assert shard_files(tmp_path / "a", kind) == shard_files(tmp_path / "b", kind)


def test_a_worker_that_is_killed_once_costs_nothing(tmp_path):
    once, listener = tmp_path / "once", Listener()
    once.touch()
    factory = functools.partial(Deadly, deadly=[33], once=once)
    assert run_sweep(tmp_path / "a", plan_of(), listener, factory, pool=Processes(2)).finished
    assert any(
        event.text.startswith("members 30 to 39 were not computed") for event in listener.of(Warned)
    )
    run_sweep(tmp_path / "b")
    assert shard_files(tmp_path / "a") == shard_files(tmp_path / "b")


@pytest.mark.parametrize(
    ("lost", "expected"), [([0], 3 + 3), ([19], 3 + 4), ([4, 5], 3 + 4 + 3), ([], 0)]
)
def test_how_often_members_are_tried(tmp_path, lost, expected):
    """Ten members three times, then each half with a lost member once, down to the member."""
    pool, listener = Pool(lambda: Forgetful(lost, MemoryError("made up")), 1), Listener()
    done = run_sweep(tmp_path / "a", plan_of(20), listener, pool=pool)
    assert done.finished
    assert [k for k, status in enumerate(statuses(tmp_path / "a")) if status == "crashed"] == lost
    warnings = [event.text for event in listener.of(Warned)]
    assert all("(made up)" in text for text in warnings)
    assert len(warnings) == expected
    assert sum("given up" in text for text in warnings) == len(lost)


def test_results_that_change_on_the_way_are_computed_again(tmp_path):
    listener = Listener()
    assert run_sweep(tmp_path / "a", listener=listener, pool=Pool(Careless, 1)).finished
    [warning] = [event.text for event in listener.of(Warned)]
    assert "not computed (their results changed on the way from the worker)" in warning
    run_sweep(tmp_path / "b")
    assert shard_files(tmp_path / "a") == shard_files(tmp_path / "b")


def test_the_digest_of_columns_is_that_of_their_names_types_shapes_and_bytes():
    columns = {"v": np.arange(6.0).reshape(2, 3)}
    same = {"v": np.asfortranarray(columns["v"])}
    changed = [
        {"w": columns["v"]},
        {"v": columns["v"].reshape(3, 2)},
        {"v": columns["v"].view("i8")},
        {"v": np.nextafter(columns["v"], 9.0)},
        columns | same | {"w": np.zeros(0)},
    ]
    assert digest_of_columns(same) == digest_of_columns(columns)
    assert len({digest_of_columns(other) for other in (columns, *changed)}) == 6


def test_another_error_of_a_worker_ends_the_sweep(tmp_path):
    pool = Pool(lambda: Forgetful([35], ZeroDivisionError("made up")), 1)
    with pytest.raises(ExecutorError, match="a worker cannot compute: ZeroDivisionError: made up"):
        run_sweep(tmp_path / "a", pool=pool)
    assert sorted(shard_files(tmp_path / "a")) == [f"{k:08d}.h5" for k in range(3)]


def both(path, plan, listener, factory, count=1):
    """Compute all shards in this process and in workers beside it, and return the inventory."""
    with open_folder(path, plan, 10) as opened:
        inventory = shard_inventory(opened.folder)
        pools = [Threads(), Processes(count)]
        ShardRun(plan, opened.folder, pools, listener, factory=factory).compute(inventory)
    return inventory


def no_engine_elsewhere(plan):
    if os.getpid() != int(os.environ["RBSTAB_TEST_PARENT"]):
        raise ZeroDivisionError("cannot be made")
    return SLOW(plan)


@pytest.mark.parametrize("reason", ["no process", "no engine"])
def test_without_workers_all_is_computed_here(tmp_path, monkeypatch, reason):
    monkeypatch.setenv("RBSTAB_TEST_PARENT", str(os.getpid()))
    if reason == "no process":

        def refuse(*_):
            raise OSError("Resource temporarily unavailable")

        monkeypatch.setattr("loky.backend.process.LokyProcess.start", refuse)
    listener = Listener()
    assert not both(tmp_path / "a", plan_of(), listener, no_engine_elsewhere).missing
    assert listener.computed == list(range(6))
    with pytest.raises(ExecutorError, match="no worker process can compute"):
        run_sweep(tmp_path / "b", factory=no_engine_elsewhere, pool=Processes(1))


def test_no_member_waits_for_a_process_to_start(tmp_path):
    """The workers import for longer than this process computes."""
    begin, before = time.monotonic(), children()
    assert not both(tmp_path / "a", plan_of(), Listener(), slow_to_start).missing
    assert time.monotonic() - begin < 30
    assert not [child for child in children() if child not in before]


def slow_to_start(plan):
    if "popen_loky" in " ".join(sys.orig_argv):
        time.sleep(60)
    return FakeEngine(plan)


def test_a_full_disk_ends_the_sweep_and_its_workers(tmp_path, monkeypatch):
    def full(*_, **options):
        raise StoreError("a.h5 cannot be written: No space left on device")

    before = children()
    with monkeypatch.context() as patch:
        patch.setattr("rbstab.sweep.folder.sweep_folder.write_dataset", full)
        with pytest.raises(StoreError, match="No space left"):
            run_sweep(tmp_path / "a", factory=SLOW, pool=Processes(2))
    assert not [child for child in children() if child not in before]
    assert run_sweep(tmp_path / "a").finished
    run_sweep(tmp_path / "b")
    assert digest_of(tmp_path / "a") == digest_of(tmp_path / "b")


def children(parent=None):
    """Return the running worker processes that a process has started."""
    processes = psutil.Process(parent).children(recursive=True)
    return [child for child in processes if "popen_loky" in " ".join(command(child))]


def command(process):
    try:
        return process.cmdline()
    except psutil.Error:
        return []


SWEEPER = """
import sys
from pathlib import Path
from support.sweeping import Listener
from support.sweeps import plan_of
from test_lost_workers import SLOW, both
class Printing(Listener):
    def __call__(self, event):
        print(event or "()", flush=True)
both(Path(sys.argv[1]), plan_of(3000), Printing(), SLOW)
"""


@pytest.fixture
def sweeper(tmp_path):
    """A process that runs a sweep with a worker and has stored a shard, and its worker."""
    path = [str(Path(__file__).parent), str(Path(__file__).parents[2])]
    with subprocess.Popen(
        [sys.executable, "-c", SWEEPER, str(tmp_path / "a")],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([*path, *sys.path])},
        start_new_session=True,
    ) as process:
        assert process.stdout is not None
        while not children(process.pid):
            assert "(" in process.stdout.readline()
        yield process, children(process.pid)[0]
        process.kill()


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="nothing is killed like that here")
def test_a_worker_does_not_outlive_its_parent(sweeper):
    process, worker = sweeper
    process.kill()
    worker.wait(30)


@pytest.mark.skipif(os.name != "posix", reason="no terminal interrupts like that here")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_to_all_processes_is_not_for_a_worker(sweeper, number):
    """A terminal sends interrupts to all processes, and a job system SIGTERM, at any time."""
    process, worker = sweeper
    worker.send_signal(number)
    # An empty pair is printed when no shard is done for a while.
    lines = (line for line in process.stdout if line != "()\n")
    assert all(ShardDone.__name__ in line for line in islice(lines, 40))
    assert worker.is_running()
    assert worker.status() != psutil.STATUS_ZOMBIE
