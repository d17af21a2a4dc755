"""Protects the stored traces of a sweep: their content, their readers, and their size."""

import functools

import numpy as np
import pytest
import xarray
from support.sweeping import Listener, run_sweep
from support.sweeps import FakeEngine, plan_with_traces, shard_files

import rbstab
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.sweep.folder.open_folder import MAX_TRACE_BYTES, default_shard_size, sweep_bytes

EVERY = {"traces": {"every": 7}}


def folder_size(path, *kinds):
    return sum(f.stat().st_size for kind in kinds for f in (path / kind).glob("*.*"))


def test_what_is_stored(tmp_path):
    plan = plan_with_traces(60, EVERY)
    assert run_sweep(tmp_path / "a", plan).finished
    traces = rbstab.open_traces(tmp_path / "a")
    expected = FakeEngine(plan).compute(0, 60).traces
    assert expected is not None
    assert traces.members.tolist() == list(range(0, 60, 7))
    assert (traces.times == np.linspace(0, 0.02, 5)).all()
    assert len(traces) == 9
    for place, member in enumerate(range(0, 60, 7)):
        trace = traces.of(member)
        assert trace["run"] == member
        for name, data in expected.items():
            assert (trace[name] == (data if name == "time" else data[place])).all(), name
    parts = list(traces)
    assert np.concatenate([part["run"] for part in parts]).tolist() == traces.members.tolist()
    together = np.concatenate([part["position"] for part in parts])
    assert (together == expected["position"]).all()
    table = rbstab.open_sweep(tmp_path / "a")
    assert np.flatnonzero(table["traces"]).tolist() == traces.members.tolist()
    assert table.words("traces")[[0, 1]].tolist() == ["yes", "no"]


def test_as_a_dataset(tmp_path):
    run_sweep(tmp_path / "a", plan_with_traces())
    traces = rbstab.open_traces(tmp_path / "a")
    data = traces.to_xarray([58, 3])
    assert data["run"].values.tolist() == [58, 3]
    assert data["lyapunov"].dims == ("run", "time")
    assert data["position"].attrs["units"] == "m"
    path = tmp_path / "a" / "traces" / "00000000.h5"
    with xarray.open_dataset(path, engine="h5netcdf") as stored:
        assert set(data.variables) - set(stored.variables) == {"initial_angular_velocity_0"}
        for name in stored.variables:
            assert stored[name].attrs == data[name].attrs, name
            assert stored[name].dims == data[name].dims, name
        assert (stored["position"].sel(run=3) == data["position"].sel(run=3)).all()
    with pytest.raises(ValueError, match="no members"):
        traces.to_xarray([])


def test_a_sweep_without_traces(tmp_path):
    run_sweep(tmp_path / "a", plan_with_traces(keep="summary"))
    assert not (tmp_path / "a" / "traces").exists()
    assert "traces" not in rbstab.open_sweep(tmp_path / "a")
    with pytest.raises(StoreError, match="its plan stores none"):
        rbstab.open_traces(tmp_path / "a")
    with pytest.raises(NotAResultError, match="not the folder of a sweep"):
        rbstab.open_traces(tmp_path)


def test_members_that_have_none(tmp_path):
    run_sweep(tmp_path / "a", plan_with_traces(keep={"traces": [3, 55]}))
    traces = rbstab.open_traces(tmp_path / "a")
    assert len(shard_files(tmp_path / "a", "traces")) == 2
    for member in (0, 4, 15, 59, 60, -1):
        with pytest.raises(KeyError, match="has no trace"):
            traces.of(member)


def test_an_unfinished_sweep(tmp_path):
    slow = functools.partial(FakeEngine, delay=1e-3)
    run_sweep(tmp_path / "a", plan_with_traces(100), Listener(1), factory=slow, threads=1)
    (tmp_path / "a" / "shards" / "00000001.h5").unlink(missing_ok=True)
    traces = rbstab.open_traces(tmp_path / "a")
    assert traces.members.tolist() == list(range(10))
    (tmp_path / "a" / "shards" / "00000000.h5").unlink()
    with pytest.raises(StoreError, match="none is stored yet"):
        rbstab.open_traces(tmp_path / "a")


def test_a_number_that_has_changed_on_the_disk(tmp_path):
    path = tmp_path / "a"
    run_sweep(path, plan_with_traces())
    file = path / "traces" / "00000004.h5"
    content = file.read_bytes()
    file.write_bytes(content[:4000] + bytes([content[4000] ^ 1]) + content[4001:])
    traces = rbstab.open_traces(path)
    assert np.isfinite(traces.of(39)["position"]).all()
    for read in (lambda: traces.of(40), lambda: list(traces), lambda: traces.to_xarray([1, 45])):
        with pytest.raises(NotAResultError, match=r"damaged.*Remove .*00000004.h5 and"):
            read()


@pytest.mark.parametrize("keep", ["summary", "traces", EVERY])
def test_what_a_sweep_takes_on_the_disk(tmp_path, keep):
    plan = plan_with_traces(2000, keep)
    run_sweep(tmp_path / "a", plan, shard_size=1000)
    size = folder_size(tmp_path / "a", ".", "shards", "traces")
    assert sweep_bytes(plan) == pytest.approx(size, rel=0.1)


def test_a_disk_without_room_is_told_before_anything_is_done(tmp_path, monkeypatch):
    plan = plan_with_traces(2000)
    free, listener = [sweep_bytes(plan) - 1], Listener()
    usage = type("Usage", (), {"free": property(lambda _: free[0])})
    monkeypatch.setattr("rbstab.sweep.folder.open_folder.shutil.disk_usage", lambda _: usage())
    with pytest.raises(StoreError, match=r"GB more, and .* GB are free"):
        run_sweep(tmp_path / "a", plan, listener, shard_size=1000)
    assert listener.events == []
    free[0] += 10**6
    assert run_sweep(tmp_path / "a", plan, shard_size=1000).finished
    # Stored shards need no more space.
    free[0] = 0
    assert run_sweep(tmp_path / "a", plan, shard_size=1000).finished
    (tmp_path / "a" / "traces" / "00000001.h5").unlink()
    with pytest.raises(StoreError, match="are free"):
        run_sweep(tmp_path / "a", plan, shard_size=1000)


def test_shards_with_traces_are_small_enough_for_the_memory():
    assert default_shard_size(10**6, has_single_runs=False) == 4096
    assert default_shard_size(10**6, has_single_runs=False, trace_bytes=400.0) == 4096
    for size in (40_000, 500_000, 10**7, 10**9):
        members = default_shard_size(10**6, has_single_runs=False, trace_bytes=size)
        assert members == 1 or MAX_TRACE_BYTES / 2 < members * size <= MAX_TRACE_BYTES
    assert default_shard_size(10**6, has_single_runs=True, trace_bytes=10**7) == 3
    assert default_shard_size(10**6, has_single_runs=True, trace_bytes=10.0) == 16
