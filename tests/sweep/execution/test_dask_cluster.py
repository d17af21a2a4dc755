"""Protects sweeps on a real Dask cluster: workers and the scheduler are killed."""

import functools
import time
from dataclasses import replace

import pytest
from distributed import Client
from support.clusters import DeadlyEngine, LocalProcesses
from support.sweeping import Listener, digest_of, run_sweep
from support.sweeps import FakeEngine, plan_of, shard_files

from rbstab.sweep.execution.computing import Task, WorkerDiffersError, difference
from rbstab.sweep.execution.dask_cluster import ClusterError, cluster
from rbstab.sweep.execution.events import ShardDone, Started, Warned
from rbstab.sweep.execution.run import AHEAD
from rbstab.sweep.folder.sweep_table import read_sweep
from rbstab.sweep.plan.load import plan_data

pytestmark = pytest.mark.slow

SLOW = functools.partial(FakeEngine, delay=1e-3)


def sweep_on_cluster(processes, path, plan=None, factory=FakeEngine, listener=None, **options):
    with cluster(processes.address, "scipy") as pool:
        return run_sweep(path, plan, listener, factory, pool=pool, **options)


class Acting(Listener):
    """A listener that acts at the `count`-th event of a kind."""

    def __init__(self, kind, count, act):
        super().__init__()
        self.kind, self.count, self.act = kind, count, act


def warnings(listener):
    return [event.text for event in listener.of(Warned)]


def test_a_worker_is_killed_midway(tmp_path):
    plan = plan_of(600)
    with LocalProcesses(tmp_path) as processes:
        victim, _ = processes.worker(), processes.worker()
        listener = Acting(ShardDone, 5, lambda: processes.kill(victim))
        assert sweep_on_cluster(processes, tmp_path / "a", plan, SLOW, listener).finished
    assert listener.computed == list(range(60))
    run_sweep(tmp_path / "b", plan)
    assert shard_files(tmp_path / "a") == shard_files(tmp_path / "b")


@pytest.mark.heavy
def test_a_member_that_kills_every_worker_is_given_up_alone(tmp_path):
    environment = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"}
    with LocalProcesses(tmp_path, environment) as processes:
        processes.worker()
        processes.worker()

        # One worker is lost with the shard each time, until it is halved down to member 7.
        class Starting(Acting):
            def __call__(self, event):
                super().__call__(event)
                if isinstance(event, Warned):
                    processes.worker()

        listener = Starting(Warned, None, lambda: None)
        done = sweep_on_cluster(processes, tmp_path / "a", plan_of(40), DeadlyEngine, listener)
    assert done.finished
    status = read_sweep(tmp_path / "a" / "members.h5").words("status").tolist()
    assert [k for k, word in enumerate(status) if word != "completed"] == [7]
    assert status[7] == "crashed"
    run_sweep(tmp_path / "b", plan_of(40))
    files, expected = (shard_files(tmp_path / name) for name in "ab")
    assert [name for name in files if files[name] != expected[name]] == ["00000000.h5"]


def test_the_scheduler_is_lost_and_the_sweep_goes_on_elsewhere(tmp_path):
    plan = plan_of(600)
    with LocalProcesses(tmp_path) as processes:
        processes.worker()
        listener = Acting(ShardDone, 5, lambda: processes.kill(processes.scheduler))
        with pytest.raises(ClusterError, match="does not answer any more"):
            sweep_on_cluster(processes, tmp_path / "a", plan, SLOW, listener)
    stored = shard_files(tmp_path / "a")
    assert 5 <= len(stored) < 60
    run_sweep(tmp_path / "a", plan)
    assert stored.items() <= shard_files(tmp_path / "a").items()
    run_sweep(tmp_path / "b", plan)
    assert digest_of(tmp_path / "a") == digest_of(tmp_path / "b")


def test_the_cluster_has_at_most_two_shards_a_thread(tmp_path):
    running = []
    with LocalProcesses(tmp_path) as processes:
        processes.worker()
        processes.worker()
        with cluster(processes.address, "scipy") as pool:
            plan = plan_of(300)

            class Counting(Listener):
                def __call__(self, event):
                    super().__call__(event)
                    states = pool._client.futures.values()  # type: ignore[attr-defined]
                    running.append(sum(state.status == "pending" for state in states))

            listener = Counting()
            run_sweep(tmp_path / "a", plan, listener, SLOW, pool=pool, shard_size=2)
    assert len(listener.computed) == 150
    assert 2 < max(running) <= 2 * AHEAD


def test_a_sweep_waits_for_workers(tmp_path):
    with LocalProcesses(tmp_path) as processes:
        listener = Acting(Warned, 1, processes.worker)
        assert sweep_on_cluster(processes, tmp_path / "a", listener=listener).finished
    assert warnings(listener) == ["the cluster has no workers; waiting for workers"]


def preloaded(processes, folder, text):
    """Start a worker that runs a program first, and wait for it."""
    (folder / "preload.py").write_text(text)
    processes.worker("--preload", str(folder / "preload.py"))
    with Client(processes.address, set_as_default=False) as client:
        client.wait_for_workers(1)


WRONG_VERSION = """
import importlib.metadata as metadata
known = metadata.version
metadata.version = lambda name: "99.0" if name == "rbstab" else known(name)
"""
NO_PROGRAM = "import sys\nsys.modules['rbstab'] = None\n"


@pytest.mark.parametrize(
    ("preload", "error", "message"),
    [
        (WRONG_VERSION, WorkerDiffersError, r"the worker tcp:.* has rbstab 99.0, not .*differ"),
        (NO_PROGRAM, ClusterError, r"the worker.* cannot .*rbstab"),
    ],
    ids=["version", "program"],
)
def test_workers_that_differ_are_refused(tmp_path, preload, error, message):
    with LocalProcesses(tmp_path) as processes:
        preloaded(processes, tmp_path, preload)
        with pytest.raises(error, match=message):
            sweep_on_cluster(processes, tmp_path / "a")
    assert not (tmp_path / "a").exists()


def test_a_worker_that_joins_late_is_refused_too(tmp_path):
    (tmp_path / "preload.py").write_text(WRONG_VERSION)
    options = ("--preload", str(tmp_path / "preload.py"))
    with LocalProcesses(tmp_path) as processes:
        listener = Acting(Started, 1, lambda: processes.worker(*options))
        with pytest.raises(WorkerDiffersError, match=r"the worker .* has rbstab 99.0, not "):
            sweep_on_cluster(processes, tmp_path / "a", listener=listener)
    assert shard_files(tmp_path / "a") == {}


def test_another_processor_is_told_once(tmp_path):
    (tmp_path / "cpuinfo").write_text("processor : 0\nmodel name : Abacus 9\n")
    other = (
        "import pathlib\n"
        "from rbstab.sweep.execution import computing\n"
        f"computing.CPU_INFO = pathlib.Path({str(tmp_path / 'cpuinfo')!r})\n"
    )
    listener = Listener()
    with LocalProcesses(tmp_path) as processes:
        preloaded(processes, tmp_path, other)
        assert sweep_on_cluster(processes, tmp_path / "a", listener=listener).finished
    name = "some shards were computed on another kind of processor: Abacus 9"
    assert warnings(listener) == [name]


def test_nobody_answers():
    begin = time.monotonic()
    for address in ("tcp://127.0.0.1:9", "nonsense://x", "127.0.0.1", ""):
        with pytest.raises(ClusterError, match="cannot be reached"), cluster(address, "scipy", 0.5):
            pass
    with pytest.raises(ClusterError, match="no such file"), cluster("none.json", "scipy"):
        pass
    assert time.monotonic() - begin < 60  # This only excludes a hang; it measures nothing.


def test_versions_that_are_not_the_same():
    versions = {"rbstab": "1", "its commit": "abc", "numpy": "2.0"}
    assert difference(versions, dict(versions)) == ""
    assert difference(versions, {**versions, "numpy": "2.1"}) == "numpy 2.1, not 2.0"
    assert difference(versions, {**versions, "its commit": "def"}) == "its commit def, not abc"
    assert difference(versions, {**versions, "its commit": ""}) == ""  # installed from a package
    assert difference(versions, {"rbstab": "1", "its commit": ""}) == "numpy ?, not 2.0"


def test_a_task_that_loads_another_plan_is_refused():
    task = Task.of(plan_of(50), None, elsewhere=True)
    assert not task(0, 1).error
    other = replace(task, name="other", plan=plan_data(plan_of(51)))
    with pytest.raises(WorkerDiffersError, match="another plan"):
        other(0, 1)
