"""Protects resumed traces: lost, missing or outdated traces are computed again, no others."""

import functools

import pytest
from support.sweeping import HARMS, Listener, digest_of, harmed, run_sweep
from support.sweeps import FakeEngine, plan_with_traces, shard_files

import rbstab
from rbstab.store.dataset_file import write_dataset
from rbstab.store.disk.paths import open_regular
from rbstab.store.errors import StoreError
from rbstab.sweep.execution.events import Warned
from rbstab.sweep.folder.shard_inventory import shard_inventory
from rbstab.sweep.folder.sweep_folder import read_folder
from rbstab.sweep.folder.sweep_table import read_sweep


@pytest.mark.parametrize("harm", [*HARMS, "remove"])
def test_traces_that_are_lost_are_made_again(tmp_path, harm):
    path = tmp_path / "a"
    run_sweep(path, plan_with_traces())
    before, shards = shard_files(path, "traces"), shard_files(path)
    file = path / "traces" / "00000004.h5"
    if harm == "remove":
        file.unlink()
    else:
        file.write_bytes(harmed(file.read_bytes(), before["00000003.h5"], harm))
    listener = Listener()
    assert run_sweep(path, plan_with_traces(), listener).finished
    assert listener.computed == [4]
    assert shard_files(path, "traces") == before
    assert shard_files(path) == shards


def test_looking_how_far_a_sweep_is_reads_no_traces(tmp_path, monkeypatch):
    """Only the end of each file is read: the traces of a sweep may take many gigabytes."""
    run_sweep(tmp_path / "a", plan_with_traces())
    opened = []

    class Counting:
        def __init__(self, file):
            self.file, self.bytes_read = file, 0

        def read(self, size=-1):
            found = self.file.read(size)
            self.bytes_read += len(found)
            return found

        def __getattr__(self, name):
            return getattr(self.file, name)

        def __enter__(self):
            return self

        def __exit__(self, *_):
            self.file.close()

    def counting_open(path):
        file = open_regular(path)
        if path.parent.name != "traces":
            return file
        opened.append(Counting(file))
        return opened[-1]

    monkeypatch.setattr("rbstab.store.dataset_file.open_regular", counting_open)
    folder = read_folder(tmp_path / "a")
    assert len(shard_inventory(folder).done) == 6
    assert len(opened) == 6
    assert all(file.bytes_read < 100 for file in opened)


def test_the_identity_of_a_finished_sweep_covers_traces(tmp_path):
    """The columns are equal and a trace differs: the members file is written again."""

    class Other(FakeEngine):
        def compute(self, start, stop):
            shard = super().compute(start, stop)
            assert shard.traces is not None
            shard.traces["position"][-1, -1, 0] += 1.0
            return shard

    path = tmp_path / "a"
    run_sweep(path, plan_with_traces())
    before, columns = read_sweep(path, ()).attributes, digest_of(path)
    (path / "traces" / "00000002.h5").unlink()
    run_sweep(path, plan_with_traces(), factory=Other)
    after = read_sweep(path, ()).attributes
    assert digest_of(path) == columns
    assert after["shards_digest"] != before["shards_digest"]


def test_traces_of_members_that_failed_are_made_again(tmp_path):
    failing = functools.partial(FakeEngine, failing=(17,))
    run_sweep(tmp_path / "a", plan_with_traces(), factory=failing)
    listener = Listener()
    run_sweep(tmp_path / "a", plan_with_traces(), listener, retry_failed=True)
    assert listener.computed == [1]
    run_sweep(tmp_path / "b", plan_with_traces())
    for kind in ("shards", "traces"):
        assert shard_files(tmp_path / "a", kind) == shard_files(tmp_path / "b", kind)


def test_traces_that_were_never_followed_by_their_shard(tmp_path, monkeypatch):
    """The disk is full, or the process is killed, between the two files."""

    path = tmp_path / "a"
    for folder in ("shards", "traces"):

        def full(file, dataset, full=folder, **options):
            if file.parent.name == full:
                raise StoreError("a.h5 cannot be written: No space left on device")
            return write_dataset(file, dataset, **options)

        with monkeypatch.context() as patch:
            patch.setattr("rbstab.sweep.folder.sweep_folder.write_dataset", full)
            with pytest.raises(StoreError, match="No space left"):
                run_sweep(path, plan_with_traces(), threads=1)
        assert list(shard_files(path, "traces")) == ["00000000.h5"]
        assert not shard_files(path)
    (path / "traces" / ".00000003.h5.0123.part").write_text("")
    assert run_sweep(path, plan_with_traces()).finished
    assert not list(path.glob("*/.*.part"))


def test_an_engine_that_owes_traces(tmp_path):
    class Forgetful(FakeEngine):
        def compute(self, start, stop):
            return super().compute(start, stop)._replace(traces=None)

    listener = Listener()
    run_sweep(tmp_path / "a", plan_with_traces(4), listener, factory=Forgetful)
    assert "4 traces" in listener.of(Warned)[0].text
    # Single runs replaced the engine.
    run = rbstab.simulate(plan_with_traces(4).config_of(2))
    found = rbstab.open_traces(tmp_path / "a").of(2)
    assert (found["contact_force"] == run["contact_force"]).all()
