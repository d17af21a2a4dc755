"""The traces of a sweep: stored before their shards, found again, and computed again if damaged."""

import functools
import pickle

import numpy as np
import pytest
import xarray
from support.sweeping import Listener, digest_of, swept
from support.sweeps import FakeEngine, shard_files, traced

import rbstab
from rbstab.store.document import read_document, write_document
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.store.table import Head
from rbstab.store.table_file import read_table, write_shard
from rbstab.sweep.begin import LARGEST_TRACES, good_shard_size
from rbstab.sweep.execute import Trouble
from rbstab.sweep.folder import open_folder
from rbstab.sweep.layout import OUTCOME
from rbstab.sweep.room import bytes_of
from rbstab.sweep.sweep import Started

EVERY = {"traces": {"every": 7}}


def folder_size(path, *kinds):
    return sum(f.stat().st_size for kind in kinds for f in (path / kind).glob("*.h5"))


def test_what_is_stored(tmp_path):
    plan = traced(60, EVERY)
    assert swept(tmp_path / "a", plan).finished
    traces = rbstab.open_traces(tmp_path / "a")
    expected = FakeEngine(plan).compute(0, 60).traces
    assert traces.members.tolist() == list(range(0, 60, 7))
    assert (traces.times == np.linspace(0, 0.02, 5)).all()
    assert len(traces) == 9
    for place, member in enumerate(range(0, 60, 7)):
        one = traces.of(member)
        assert one["run"] == member
        for name, data in expected.items():
            assert (one[name] == (data if name == "time" else data[place])).all(), name
    parts = list(traces)
    assert np.concatenate([part["run"] for part in parts]).tolist() == traces.members.tolist()
    together = np.concatenate([part["position"] for part in parts])
    assert (together == expected["position"]).all()
    table = rbstab.open_sweep(tmp_path / "a")
    assert np.flatnonzero(table["traces"]).tolist() == traces.members.tolist()
    assert table.words("traces")[[0, 1]].tolist() == ["yes", "no"]


def test_as_a_dataset(tmp_path):
    swept(tmp_path / "a", traced())
    traces = rbstab.open_traces(tmp_path / "a")
    data = traces.to_xarray([58, 3])
    assert data["run"].values.tolist() == [58, 3]
    assert data["lyapunov"].dims == ("run", "time")
    assert data["position"].attrs["units"] == "m"
    path = tmp_path / "a" / "traces" / "00000000.h5"
    with xarray.open_dataset(path, engine="h5netcdf") as stored:
        for name in data.variables:
            assert stored[name].attrs == data[name].attrs, name
            assert stored[name].dims == data[name].dims, name
        assert (stored["position"].sel(run=3) == data["position"].sel(run=3)).all()
    with pytest.raises(ValueError, match="no members"):
        traces.to_xarray([])


def test_a_sweep_without_traces(tmp_path):
    swept(tmp_path / "a", traced(keep="summary"))
    assert not (tmp_path / "a" / "traces").exists()
    assert "traces" not in rbstab.open_sweep(tmp_path / "a").layout
    with pytest.raises(StoreError, match="its plan keeps none"):
        rbstab.open_traces(tmp_path / "a")
    with pytest.raises(NotAResultError, match="not the folder of a sweep"):
        rbstab.open_traces(tmp_path)


def test_members_that_have_none(tmp_path):
    swept(tmp_path / "a", traced(keep={"traces": [3, 55]}))
    traces = rbstab.open_traces(tmp_path / "a")
    assert len(shard_files(tmp_path / "a", "traces")) == 2
    for member in (0, 4, 15, 59, 60, -1):
        with pytest.raises(KeyError, match="has no trace"):
            traces.of(member)


def test_an_unfinished_sweep(tmp_path):
    slow = functools.partial(FakeEngine, delay=1e-3)
    swept(tmp_path / "a", traced(100), Listener(1), factory=slow, threads=1)
    (tmp_path / "a" / "shards" / "00000001.h5").unlink(missing_ok=True)
    traces = rbstab.open_traces(tmp_path / "a")
    assert traces.members.tolist() == list(range(10))
    (tmp_path / "a" / "shards" / "00000000.h5").unlink()
    with pytest.raises(StoreError, match="none of them is done yet"):
        rbstab.open_traces(tmp_path / "a")


def test_threads_and_stops_do_not_show(tmp_path):
    plan = traced(100, EVERY)
    swept(tmp_path / "1", plan, threads=1)
    swept(tmp_path / "2", plan, threads=5)
    slow = functools.partial(FakeEngine, delay=1e-3)
    for count in (1, 2):
        assert not swept(tmp_path / "3", plan, Listener(count), factory=slow).finished
    swept(tmp_path / "3", plan)
    for kind in ("shards", "traces"):
        assert shard_files(tmp_path / "1", kind) == shard_files(tmp_path / "2", kind)
        assert shard_files(tmp_path / "1", kind) == shard_files(tmp_path / "3", kind)
    again = Listener()
    assert swept(tmp_path / "1", plan, again).finished
    assert [type(event) for event in again.events] == [Started]
    swept(tmp_path / "4", plan, shard_size=33)
    ours, theirs = (rbstab.open_traces(tmp_path / name) for name in "14")
    for member in ours.members.tolist():
        for name, variable in ours.of(member).variables.items():
            assert variable.data.tobytes() == theirs.of(member)[name].tobytes(), name
    assert digest_of(tmp_path / "1") == digest_of(tmp_path / "4")


@pytest.mark.parametrize("harm", ["cut", "empty", "swap", "remove", "seal", "longer"])
def test_traces_that_are_lost_are_made_again(tmp_path, harm):
    path = tmp_path / "a"
    swept(path, traced())
    before, shards = shard_files(path, "traces"), shard_files(path)
    file = path / "traces" / "00000004.h5"
    content = file.read_bytes()
    if harm == "remove":
        file.unlink()
    else:
        file.write_bytes(
            {
                "cut": content[:-100],
                "empty": b"",
                "swap": before["00000003.h5"],
                "seal": content[:-10] + bytes([content[-10] ^ 1]) + content[-9:],
                "longer": content[:50] + b"0" + content[50:],
            }[harm]
        )
    listener = Listener()
    assert swept(path, traced(), listener).finished
    assert listener.computed == [4]
    assert shard_files(path, "traces") == before
    assert shard_files(path) == shards


def test_a_number_that_has_changed_on_the_disk(tmp_path):
    path = tmp_path / "a"
    swept(path, traced())
    file = path / "traces" / "00000004.h5"
    content = file.read_bytes()
    file.write_bytes(content[:4000] + bytes([content[4000] ^ 1]) + content[4001:])
    traces = rbstab.open_traces(path)
    assert np.isfinite(traces.of(39)["position"]).all()
    for read in (lambda: traces.of(40), lambda: list(traces), lambda: traces.to_xarray([1, 45])):
        with pytest.raises(NotAResultError, match=r"damaged.*; remove .*00000004.h5, and"):
            read()
    # What the message advises.
    file.unlink()
    listener = Listener()
    assert swept(path, traced(), listener).finished
    assert listener.computed == [4]
    assert file.read_bytes() == content
    assert (rbstab.open_traces(path).of(40)["run"]) == 40


def test_a_file_is_verified_once(tmp_path, monkeypatch):
    swept(tmp_path / "a", traced())
    traces, checked = rbstab.open_traces(tmp_path / "a"), []
    monkeypatch.setattr(
        "rbstab.sweep.stored_traces.check_motions", lambda path, _: checked.append(path.name)
    )
    for member in (11, 12, 19, 30):
        traces.of(member)
    assert checked == ["00000001.h5", "00000003.h5"]


def test_looking_how_far_a_sweep_is_reads_no_traces(tmp_path, monkeypatch):
    """At most the end of each file: of a sweep there may be many gigabytes."""
    swept(tmp_path / "a", traced())
    opened, plain = [], type(tmp_path).open

    class Counting:
        def __init__(self, file):
            self.file, self.taken = file, 0

        def read(self, size=-1):
            found = self.file.read(size)
            self.taken += len(found)
            return found

        def __getattr__(self, name):
            return getattr(self.file, name)

        def __enter__(self):
            return self

        def __exit__(self, *_):
            self.file.close()

    def watched(path, *arguments, **options):
        file = plain(path, *arguments, **options)
        if path.parent.name != "traces":
            return file
        opened.append(Counting(file))
        return opened[-1]

    monkeypatch.setattr(type(tmp_path), "open", watched)
    folder = open_folder(tmp_path / "a")
    assert all(folder.facts(number) is not None for number in range(6))
    assert len(opened) == 6
    assert all(file.taken < 100 for file in opened)


def test_a_shard_names_its_traces(tmp_path):
    swept(tmp_path / "a", traced(60, {"traces": [3]}))
    folder = open_folder(tmp_path / "a")
    attributes = read_table(folder.shard_file(0), ()).attributes
    file = folder.traces_file(0)
    assert attributes["traces_bytes"] == file.stat().st_size
    assert attributes["traces_digest"] == file.read_bytes()[-65:-1].decode()
    assert attributes["traces_digest"] in folder.facts(0).digest
    assert (
        folder.facts(1).digest == read_table(folder.shard_file(1), ()).attributes["arrays_digest"]
    )


def test_the_identity_of_what_is_gathered_covers_traces(tmp_path):
    """Columns alike, a trace not: the file of the sweep is gathered anew."""

    class Other(FakeEngine):
        def compute(self, start, stop):
            shard = super().compute(start, stop)
            shard.traces["position"][-1, -1, 0] += 1.0
            return shard

    path = tmp_path / "a"
    swept(path, traced())
    before = read_table(path / "sweep.h5", ()).attributes
    (path / "traces" / "00000002.h5").unlink()
    swept(path, traced(), factory=Other)
    after = read_table(path / "sweep.h5", ()).attributes
    assert after["arrays_digest"] == before["arrays_digest"]
    assert after["shards_digest"] != before["shards_digest"]


def test_traces_of_members_that_failed_are_made_again(tmp_path):
    failing = functools.partial(FakeEngine, failing=(17,))
    swept(tmp_path / "a", traced(), factory=failing)
    listener = Listener()
    swept(tmp_path / "a", traced(), listener, retry_failed=True)
    assert listener.computed == [1]
    swept(tmp_path / "b", traced())
    for kind in ("shards", "traces"):
        assert shard_files(tmp_path / "a", kind) == shard_files(tmp_path / "b", kind)


def test_traces_that_were_never_followed_by_their_shard(tmp_path, monkeypatch):
    """A disk that is full, or a kill, between the two files."""

    def full(*_):
        raise StoreError("a.h5 cannot be written: No space left on device")

    path = tmp_path / "a"
    with monkeypatch.context() as patch:
        patch.setattr("rbstab.sweep.folder.write_shard", full)
        with pytest.raises(StoreError, match="No space left"):
            swept(path, traced(), threads=1)
    assert list(shard_files(path, "traces")) == ["00000000.h5"]
    assert not shard_files(path)
    (path / "traces" / ".00000003.h5.0123.part").write_text("")
    with monkeypatch.context() as patch:
        patch.setattr("rbstab.sweep.folder.write_motions", full)
        with pytest.raises(StoreError, match="No space left"):
            swept(path, traced())
    assert not shard_files(path)
    assert swept(path, traced()).finished
    assert not list(path.glob("*/.*.part"))


def test_an_engine_that_owes_traces(tmp_path):
    class Forgetful(FakeEngine):
        def compute(self, start, stop):
            return super().compute(start, stop)._replace(traces=None)

    listener = Listener()
    swept(tmp_path / "a", traced(4), listener, factory=Forgetful)
    assert "4 traces" in str(listener.of(Trouble)[0].error)
    # Single runs took its place.
    run = rbstab.simulate(traced(4).config_of(2))
    found = rbstab.open_traces(tmp_path / "a").of(2)
    assert (found["contact_force"] == run["contact_force"]).all()


def test_a_shard_can_be_sent_to_another_process():
    shard = FakeEngine(traced()).compute(0, 5)
    again = pickle.loads(pickle.dumps(shard))  # noqa: S301
    assert all((again.traces[name] == data).all() for name, data in shard.traces.items())


@pytest.mark.parametrize("keep", ["summary", "traces"])
def test_folders_of_the_first_version_go_on(tmp_path, keep):
    """They had no traces: where a plan wants them, their shards are computed once more."""
    path = tmp_path / "a"
    swept(path, traced(60, keep))
    manifest = read_document(path / "manifest.json") | {"schema_version": 1}
    del manifest["keep"]
    write_document(path / "manifest.json", manifest)
    before = shard_files(path)
    if keep == "traces":
        # As the first version wrote them.
        table = read_table(path / "shards" / "00000002.h5")
        attributes = {"plan_id": table.attributes["plan_id"]}
        head = Head(OUTCOME, 20, 10, attributes)
        write_shard(path / "shards" / "00000002.h5", head, table.arrays)
        (path / "traces" / "00000002.h5").unlink()
    listener = Listener()
    assert swept(path, traced(60, keep), listener).finished
    assert listener.computed == ([2] if keep == "traces" else [])
    assert shard_files(path) == before
    again = Listener()
    assert swept(path, traced(60, keep), again).finished
    assert again.computed == []


def test_a_manifest_of_a_newer_version(tmp_path):
    path = tmp_path / "a"
    swept(path, traced())
    manifest = read_document(path / "manifest.json")
    for change, error in (
        ({"schema_version": 3}, "newer rbstab"),
        ({"schema_version": 0}, "newer rbstab"),
        ({"keep": {"every": 1}}, "damaged"),
        ({"keep": 7}, "damaged"),
    ):
        write_document(path / "manifest.json", manifest | change)
        with pytest.raises(StoreError, match=error):
            open_folder(path)


@pytest.mark.parametrize("keep", ["summary", "traces", EVERY])
def test_what_a_sweep_takes_on_the_disk(tmp_path, keep):
    plan = traced(2000, keep)
    swept(tmp_path / "a", plan, shard_size=1000)
    size = folder_size(tmp_path / "a", ".", "shards", "traces")
    assert bytes_of(plan) == pytest.approx(size, rel=0.1)


def test_a_disk_without_room_is_told_before_anything_is_done(tmp_path, monkeypatch):
    plan = traced(2000)
    free, listener = [bytes_of(plan) - 1], Listener()
    usage = type("Usage", (), {"free": property(lambda _: free[0])})
    monkeypatch.setattr("rbstab.sweep.room.shutil.disk_usage", lambda _: usage())
    with pytest.raises(StoreError, match=r"GB more, and .* GB are free"):
        swept(tmp_path / "a", plan, listener, shard_size=1000)
    assert listener.events == []
    free[0] += 10**6
    assert swept(tmp_path / "a", plan, shard_size=1000).finished
    # What is there already needs no room.
    free[0] = 0
    assert swept(tmp_path / "a", plan, shard_size=1000).finished
    (tmp_path / "a" / "traces" / "00000001.h5").unlink()
    with pytest.raises(StoreError, match="are free"):
        swept(tmp_path / "a", plan, shard_size=1000)


def test_shards_with_traces_are_small_enough_for_the_memory():
    assert good_shard_size(10**6, "heyoka") == 4096
    assert good_shard_size(10**6, "heyoka", 400.0) == 4096
    for size in (40_000, 500_000, 10**7, 10**9):
        members = good_shard_size(10**6, "heyoka", size)
        assert members == 1 or LARGEST_TRACES / 2 < members * size <= LARGEST_TRACES
    assert good_shard_size(10**6, "scipy", 10**7) == 3
    assert good_shard_size(10**6, "scipy", 10.0) == 16
