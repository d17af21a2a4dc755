"""Protects resumed traces: lost, missing or outdated traces are computed again, no others."""

import pytest
from support.sweeping import digest_of, run_sweep
from support.sweeps import FakeEngine, plan_with_traces, shard_files

from rbstab.store.dataset_file import checksum_of, write_dataset
from rbstab.store.errors import StoreError
from rbstab.sweep.folder.shard_inventory import shard_inventory
from rbstab.sweep.folder.sweep_folder import read_folder
from rbstab.sweep.folder.sweep_table import read_sweep


def test_looking_how_far_a_sweep_is_reads_no_traces(tmp_path, monkeypatch):
    """Only the end of each file is read: the traces of a sweep may take many gigabytes."""
    run_sweep(tmp_path / "a", plan_with_traces())
    whole = []

    def recorded(path, *, check):
        whole.append(check)
        return checksum_of(path, check=check)

    monkeypatch.setattr("rbstab.sweep.folder.sweep_folder.checksum_of", recorded)
    assert len(shard_inventory(read_folder(tmp_path / "a")).done) == 6
    assert whole == [False] * 6


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
