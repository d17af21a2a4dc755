"""Protects sweeps on a real Dask cluster: processes are killed, and the results keep their bits."""

import functools
import threading
import time

import numpy as np
import pytest
from distributed import Client
from support.clusters import DeadlyEngine, LocalProcesses
from support.configs import FREE, plain
from support.sweeping import EventRecorder
from support.sweeps import FakeEngine, plan_of, shard_files

from rbstab.sweep.execution import dask_executor as dask_execution
from rbstab.sweep.execution.dask_executor import ClusterError, cluster
from rbstab.sweep.execution.dask_worker import SweepPlugin, SweepTask, WorkerDiffersError
from rbstab.sweep.execution.events import (
    EngineFailed,
    NoWorkers,
    ProcessorDiffers,
    Rescheduled,
    ShardDone,
    Started,
)
from rbstab.sweep.execution.machine_properties import difference, versions
from rbstab.sweep.folder.sweep_table import read_sweep
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.plan.dump import plan_data
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.plan.plan import plan_id
from rbstab.sweep.sweep import sweep_to_folder

SLOW = functools.partial(FakeEngine, delay=1e-3)


@pytest.fixture(scope="module")
def two_workers(tmp_path_factory):
    """A cluster whose processes are not killed."""
    with LocalProcesses(tmp_path_factory.mktemp("cluster")) as processes:
        processes.worker()
        processes.worker()
        yield processes


def sweep_on_cluster(
    address, path, plan, factory=FakeEngine, *, on_event=None, stop=None, **options
):
    options = {"shard_size": 10, **options}
    with cluster(address, plan.engine, factory) as executor:
        return sweep_to_folder(
            plan,
            path,
            SweepOptions(executor=executor, **options),
            on_event or EventRecorder(),
            stop,
        )


def sweep_here(path, plan, factory=FakeEngine, **options):
    """Run a sweep by threads of this process and return its folder."""
    sweep_to_folder(plan, path, SweepOptions(factory, **{"shard_size": 10, **options}))
    return path


def same(one, other):
    """Assert that two sweeps have the same columns; return whether their shards are equal."""
    tables = [read_sweep(path / "members.h5") for path in (one, other)]
    assert tables[0].attributes["arrays_digest"] == tables[1].attributes["arrays_digest"]
    for name in tables[0].layout:
        assert tables[0][name].tobytes() == tables[1][name].tobytes(), name
    return shard_files(one) == shard_files(other)


@pytest.mark.slow
def test_real_members_by_workers_and_by_threads(two_workers, tmp_path):
    base = {**plain(FREE), "integration": {"engine": "heyoka", "duration": 0.2, "samples": 5}}
    plan = plan_of(150, base=base, keep={"traces": {"every": 7}})
    on_event = EventRecorder()
    done = sweep_on_cluster(
        two_workers.address, tmp_path / "a", plan, None, on_event=on_event, shard_size=20
    )
    assert done.finished
    assert not on_event.of(EngineFailed)
    assert set(read_sweep(tmp_path / "a" / "members.h5").words("status")) == {"completed"}
    assert same(tmp_path / "a", sweep_here(tmp_path / "b", plan, None, shard_size=20))
    traces = shard_files(tmp_path / "a", "traces")
    assert len(traces) == 8
    assert traces == shard_files(tmp_path / "b", "traces")


@pytest.mark.slow
def test_a_worker_is_killed_midway(tmp_path):
    plan = plan_of(600)
    with LocalProcesses(tmp_path) as processes:
        victim, _ = processes.worker(), processes.worker()
        on_event = EventRecorder(ShardDone, 5, lambda: processes.kill(victim))
        done = sweep_on_cluster(processes.address, tmp_path / "a", plan, SLOW, on_event=on_event)
    assert done.finished
    assert len(on_event.of(ShardDone)) == 60
    assert same(tmp_path / "a", sweep_here(tmp_path / "b", plan))


@pytest.mark.slow
def test_members_that_kill_every_worker_are_computed_here(tmp_path):
    plan = plan_of(100)
    environment = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"}
    with LocalProcesses(tmp_path, environment) as processes:

        def start_two_workers():
            for _ in range(2):
                processes.worker()

        start_two_workers()
        start_two_workers()
        on_event = EventRecorder(NoWorkers, 1, start_two_workers)
        done = sweep_on_cluster(
            processes.address, tmp_path / "a", plan, DeadlyEngine, on_event=on_event
        )
    assert done.finished
    lost = [event for event in on_event.of(Rescheduled) if event.start == 0]
    assert [event.here for event in lost] == [False, False, True]
    assert {type(event.error).__name__ for event in lost} == {"KilledWorker"}
    assert same(tmp_path / "a", sweep_here(tmp_path / "b", plan))


@pytest.mark.slow
def test_the_scheduler_is_lost_and_the_sweep_goes_on_elsewhere(tmp_path):
    plan = plan_of(600)
    with LocalProcesses(tmp_path) as processes:
        processes.worker()
        on_event = EventRecorder(ShardDone, 5, lambda: processes.kill(processes.scheduler))
        with pytest.raises(ClusterError, match="does not answer any more"):
            sweep_on_cluster(processes.address, tmp_path / "a", plan, SLOW, on_event=on_event)
    stored = shard_files(tmp_path / "a")
    assert 5 <= len(stored) < 60
    sweep_here(tmp_path / "a", plan)
    assert stored.items() <= shard_files(tmp_path / "a").items()
    assert same(tmp_path / "a", sweep_here(tmp_path / "b", plan))


def test_stopping_and_going_on(two_workers, tmp_path):
    plan, stop = plan_of(300), threading.Event()
    on_event = EventRecorder(ShardDone, 3, stop.set)
    assert not sweep_on_cluster(
        two_workers.address, tmp_path / "a", plan, SLOW, on_event=on_event, stop=stop
    ).finished
    first = len(on_event.of(ShardDone))
    # Shards that the cluster was computing at the stop are stored too.
    assert len(shard_files(tmp_path / "a")) == first < 30
    on_event = EventRecorder()
    assert sweep_on_cluster(two_workers.address, tmp_path / "a", plan, on_event=on_event).finished
    assert len(on_event.of(ShardDone)) == 30 - first
    assert same(tmp_path / "a", sweep_here(tmp_path / "b", plan))


def test_no_more_is_with_the_cluster_than_its_workers_need(two_workers, tmp_path):
    pending, plan = [], plan_of(300)
    with cluster(two_workers.address, "scipy", SLOW) as executor:
        two_threads = dask_execution.SHARDS_PER_THREAD * 2 + dask_execution.SPARE_SHARDS

        def on_event(event):
            if isinstance(event, ShardDone):
                pending.append(len(executor.client.futures))

        sweep_to_folder(
            plan, tmp_path / "a", SweepOptions(executor=executor, shard_size=2), on_event
        )
    assert len(pending) == 150
    assert 2 < max(pending) <= two_threads


def test_an_engine_that_raises_on_a_worker(two_workers, tmp_path):
    base = {**plain(FREE), "integration": {"duration": 0.02, "samples": 3, "rtol": 1e-6}}
    plan, on_event = plan_of(12, base=base), EventRecorder()
    raising = functools.partial(FakeEngine, raising=(4,))
    done = sweep_on_cluster(
        two_workers.address, tmp_path / "a", plan, raising, on_event=on_event, shard_size=3
    )
    assert done.finished
    (failed,) = on_event.of(EngineFailed)
    assert (failed.start, failed.stop) == (3, 6)
    assert str(failed.error) == "ZeroDivisionError: made up"
    sweep_here(tmp_path / "b", plan, raising, shard_size=3)
    assert same(tmp_path / "a", tmp_path / "b")


def test_the_first_failure_stops_a_cluster_too(two_workers, tmp_path):
    failing = functools.partial(FakeEngine, failing=(17,), delay=1e-3)
    on_event = EventRecorder()
    done = sweep_on_cluster(
        two_workers.address,
        tmp_path / "a",
        plan_of(600),
        failing,
        on_event=on_event,
        fail_fast=True,
    )
    assert not done.finished
    assert done.inventory.first_failed == 17
    assert len(on_event.of(ShardDone)) < 60


WRONG_VERSION = """
import importlib.metadata as metadata
known = metadata.version
metadata.version = lambda name: "99.0" if name == "rbstab" else known(name)
"""


@pytest.mark.slow
def test_workers_of_another_version_are_refused(tmp_path):
    (tmp_path / "preload.py").write_text(WRONG_VERSION)
    options = ("--preload", str(tmp_path / "preload.py"))
    with LocalProcesses(tmp_path) as processes:
        # A worker that connects after the start of the sweep is refused at its first shard.
        on_event = EventRecorder(Started, 1, lambda: processes.worker(*options))
        with pytest.raises(WorkerDiffersError, match=r"a worker has rbstab 99.0, not "):
            sweep_on_cluster(processes.address, tmp_path / "a", plan_of(), on_event=on_event)
        assert shard_files(tmp_path / "a") == {}
        with pytest.raises(WorkerDiffersError, match=r"the worker tcp:.* results would differ"):
            sweep_on_cluster(processes.address, tmp_path / "b", plan_of())
    assert not (tmp_path / "b").exists()


@pytest.mark.slow
def test_workers_without_the_program_are_refused(tmp_path):
    (tmp_path / "preload.py").write_text("import sys\nsys.modules['rbstab'] = None\n")
    with LocalProcesses(tmp_path) as processes:
        processes.worker("--preload", str(tmp_path / "preload.py"))
        with Client(processes.address, set_as_default=False) as client:
            client.wait_for_workers(1)
        with pytest.raises(ClusterError, match=r"the worker.* cannot .*rbstab"):
            sweep_on_cluster(processes.address, tmp_path / "a", plan_of())
    assert not (tmp_path / "a").exists()


@pytest.mark.slow
def test_another_processor_is_told_once(tmp_path):
    (tmp_path / "cpuinfo").write_text("processor : 0\nmodel name : Abacus 9\n")
    (tmp_path / "preload.py").write_text(
        "import pathlib\n"
        "from rbstab.sweep.execution import machine_properties\n"
        f"machine_properties.CPU_INFO = pathlib.Path({str(tmp_path / 'cpuinfo')!r})\n"
    )
    on_event = EventRecorder()
    with LocalProcesses(tmp_path) as processes:
        processes.worker("--preload", str(tmp_path / "preload.py"))
        assert sweep_on_cluster(
            processes.address, tmp_path / "a", plan_of(), on_event=on_event
        ).finished
    assert on_event.of(ProcessorDiffers) == [ProcessorDiffers("Abacus 9")]


def test_nobody_answers(tmp_path):
    begin = time.monotonic()
    for address in ("tcp://127.0.0.1:9", "nonsense://x", "127.0.0.1", ""):
        with (
            pytest.raises(ClusterError, match="cannot be reached"),
            cluster(address, "scipy", None, 0.5),
        ):
            pass
    with pytest.raises(ClusterError, match="no such file"), cluster("none.json", "scipy"):
        pass
    assert time.monotonic() - begin < 60  # This only excludes a hang; it measures nothing.


def test_an_order_gives_the_plan_that_was_meant():
    plan = plan_of(50)
    task = SweepTask(plan_data(plan), plan_id(plan), "scipy", versions("scipy"))
    assert plan_id(SweepPlugin(task).plan) == plan_id(plan)
    other = SweepTask(plan_data(plan_of(51)), plan_id(plan), "scipy", versions("scipy"))
    with pytest.raises(WorkerDiffersError, match="another plan"):
        _ = SweepPlugin(other).plan


def test_the_data_of_a_plan_keep_every_bit():
    rng = np.random.default_rng(1)
    values = rng.normal(size=20).tolist()
    plan = plan_of(vary={"initial.angular_velocity[0]": {"values": values}})
    again = load_plan(plan_data(plan))
    key = "initial.angular_velocity[0]"
    assert again.values(0, 20)[key].tobytes() == np.array(values).tobytes()


def test_versions_that_are_not_the_same():
    ours = {"rbstab": "1", "its commit": "abc", "numpy": "2.0"}
    assert difference(ours, dict(ours)) == ""
    assert difference(ours, {**ours, "numpy": "2.1"}) == "numpy 2.1, not 2.0"
    assert difference(ours, {**ours, "its commit": "def"}) == "its commit def, not abc"
    assert difference(ours, {**ours, "its commit": ""}) == ""  # installed from a package
    assert difference(ours, {"rbstab": "1", "its commit": ""}) == "numpy ?, not 2.0"
