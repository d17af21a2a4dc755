"""Protects the bits of members: they depend on the plan alone, however a sweep is computed."""

from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.clusters import LocalProcesses
from support.configs import FREE, plain
from support.sweeping import Listener, digest_of, run_sweep
from support.sweeps import FakeEngine, plan_of, plan_with_traces, shard_files

import rbstab
from rbstab.sweep.execution.events import Warned
from rbstab.sweep.execution.pools import Pool, Processes, Threads
from rbstab.sweep.folder.open_folder import Part
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.sweep import sweep_to_folder

pytestmark = pytest.mark.slow

MEMBERS = 60
PLAN = plan_with_traces(MEMBERS, {"traces": {"every": 7}})
SLOW = partial(FakeEngine, delay=1e-4)


class LastingWorkers(ProcessPoolExecutor):
    """Worker processes of the standard library that stay alive for the next sweep."""

    def shutdown(self, wait=True, *, cancel_futures=False):
        if wait:
            super().shutdown(cancel_futures=cancel_futures)


@pytest.fixture(scope="module")
def pools(tmp_path_factory):
    """Pools of threads, of processes of the standard library, of loky and of Dask."""
    from rbstab.sweep.execution.dask_cluster import cluster

    with (
        LocalProcesses(tmp_path_factory.mktemp("cluster")) as dask,
        LastingWorkers(2, get_context("spawn")) as workers,
    ):
        dask.worker()
        dask.worker()
        with cluster(dask.address, "scipy") as cluster_pool:
            yield {
                "thread": Threads(1),
                "threads": Threads(3),
                "processes": Pool(lambda: workers, 2),
                "dask": cluster_pool,
                "loky": Processes(2),
            }


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The folder of the sweep, computed by one thread in one shard."""
    path = tmp_path_factory.mktemp("whole") / "a"
    run_sweep(path, PLAN, threads=1, shard_size=MEMBERS)
    return path


SESSIONS = st.lists(
    st.tuples(
        st.sampled_from(["thread", "threads", "processes", "dask"]),
        st.one_of(st.none(), st.integers(1, 3).map(lambda number: Part(number, 3))),
        st.integers(0, 3),
    ),
    max_size=3,
)
"""Commands in one folder: where they compute, which part, and after how many shards they end."""


@pytest.mark.heavy
@settings(
    max_examples=10, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(shard_size=st.sampled_from([1, 7, 10, 16, 60]), sessions=SESSIONS)
def test_nothing_of_how_a_sweep_was_computed_shows(
    pools, whole, tmp_path_factory, shard_size, sessions
):
    path = tmp_path_factory.mktemp("sweep") / "a"
    for pool, part, shards in sessions:
        listener = Listener(shards)
        options = {"pool": pools[pool], "part": part, "shard_size": shard_size}
        run_sweep(path, PLAN, listener, SLOW, **options)
        assert len(listener.computed) == len(set(listener.computed))
        assert not listener.of(Warned)
    assert run_sweep(path, PLAN, shard_size=shard_size).finished
    assert digest_of(path) == digest_of(whole)
    traces, expected = rbstab.open_traces(path), rbstab.open_traces(whole)
    assert traces.members.tolist() == expected.members.tolist() == list(range(0, MEMBERS, 7))
    for member in traces.members.tolist():
        for name, variable in traces.of(member).variables.items():
            assert variable.data.tobytes() == expected.of(member)[name].tobytes(), name


@pytest.mark.heavy
def test_real_members_of_all_pools(pools, tmp_path):
    pytest.importorskip("heyoka")
    base = {**plain(FREE), "integration": {"engine": "heyoka", "duration": 0.2, "samples": 5}}
    plan = plan_of(150, base=base, keep={"traces": {"every": 7}})
    for name, pool in pools.items():
        listener = Listener()
        options = SweepOptions(pool=pool, shard_size=20)
        done = sweep_to_folder(plan, tmp_path / name, options, listener)
        assert done.inventory.counts[0] == 150
        assert not listener.of(Warned)
        for kind in ("shards", "traces"):
            files = shard_files(tmp_path / name, kind)
            assert len(files) == 8
            assert files == shard_files(tmp_path / "thread", kind)
