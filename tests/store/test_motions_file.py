"""Protects files of motions: every reader finds what was written, and damage is noticed."""

import errno
import hashlib
import itertools

import h5py
import netCDF4
import numpy as np
import pytest
import xarray

from rbstab.store import motions_file
from rbstab.store.disk.seal import SEAL_SIZE, read_seal
from rbstab.store.errors import NewerSchemaError, NotAResultError, StoreError
from rbstab.store.motions import Motions, stack_motions
from rbstab.store.motions_file import check_motions, read_checksum, read_motions, write_motions
from rbstab.store.variables import Variable

SAMPLES = 7


def motions(numbers=(3, 5, 8, 9)):
    rng = np.random.default_rng(1)

    def random(*dimensions):
        sizes = {"run": len(numbers), "time": SAMPLES, "axis": 3}
        data = rng.normal(size=[sizes[name] for name in dimensions])
        return Variable(dimensions, data, "m", "something")

    return Motions(
        {
            "run": Variable(("run",), np.array(numbers), "1", "number"),
            "time": Variable(("time",), np.linspace(0, 1, SAMPLES), "s", "time"),
            "axis": Variable(("axis",), np.array([1, 2, 3]), "1", "component"),
            "position": random("run", "time", "axis"),
            "energy": random("run", "time"),
        },
        {"plan_id": "abc"},
    )


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "0.h5"
    return path, write_motions(path, motions())


def assert_same(found, expected):
    assert set(found.variables) == set(expected.variables)
    assert found.attributes == expected.attributes
    for name, variable in expected.variables.items():
        assert found.variables[name].dimensions == variable.dimensions
        assert found.variables[name][2:] == variable[2:]
        assert np.array_equal(found[name], variable.data, equal_nan=True), name


def test_what_is_written_is_read(file):
    path, checksum = file
    check_motions(path, checksum)
    assert_same(read_motions(path), motions())
    assert "energy" in read_motions(path)
    assert "mass" not in read_motions(path)


def changed(name, **replaced):
    """Return motions with one variable changed."""
    found = motions()
    variables = dict(found.variables)
    variables[name] = variables[name]._replace(**replaced)
    return Motions(variables, found.attributes)


@pytest.mark.parametrize(
    "other",
    [
        motions((6, 7, 10, 12)),
        motions((1, 2)),
        changed("position", unit="km"),
        changed("energy", long_name="else"),
        changed("time", data=np.linspace(0, 2, SAMPLES)),
        changed("run", data=np.array([1, 2, 3, 4], dtype="i4")),
        Motions(motions().variables, {"plan_id": "abd"}),
        Motions(motions().variables, {"plan_id": 1}),
        Motions(motions().variables, {"plan_id": 1.0}),
    ],
)
def test_a_file_does_not_depend_on_the_one_before(tmp_path, other, monkeypatch):
    """Its layout is kept for the next file; all bytes are those of a new layout."""
    paths = [tmp_path / name for name in ("first", "second", "alone")]
    monkeypatch.setattr(motions_file, "_last_layout", {})
    write_motions(paths[0], motions())
    if other.attributes["plan_id"] == 1:
        write_motions(paths[0], Motions(motions().variables, {"plan_id": True}))
    write_motions(paths[1], other)
    monkeypatch.setattr(motions_file, "_last_layout", {})
    write_motions(paths[2], other)
    assert paths[1].read_bytes() == paths[2].read_bytes()
    assert_same(read_motions(paths[1]), other)


def test_files_of_one_sweep_share_a_layout(tmp_path, monkeypatch):
    monkeypatch.setattr(motions_file, "_last_layout", {})
    made, make = [], motions_file._new_layout

    def counted(motions):
        made.append(motions)
        return make(motions)

    monkeypatch.setattr(motions_file, "_new_layout", counted)
    for first in range(3):
        write_motions(tmp_path / f"{first}.h5", motions(range(first, first + 4)))
        assert read_motions(tmp_path / f"{first}.h5")["run"].tolist() == [*range(first, first + 4)]
    assert len(made) == 1


def test_one_run(file):
    whole, one = motions(), read_motions(file[0], 2)
    assert one["run"] == 8
    assert (one["position"] == whole["position"][2]).all()
    assert one.variables["position"].dimensions == ("time", "axis")
    assert one.variables["energy"].dimensions == ("time",)
    assert (one["time"] == whole["time"]).all()
    assert one.to_xarray()["energy"].dims == ("time",)


def test_runs_side_by_side(file):
    found = stack_motions([read_motions(file[0], row) for row in (3, 0)])
    whole = motions()
    assert found["run"].tolist() == [9, 3]
    assert (found["position"] == whole["position"][[3, 0]]).all()
    assert found.to_xarray()["position"].dims == ("run", "time", "axis")


def test_other_readers(file):
    path, expected = file[0], motions()
    with xarray.open_dataset(path, engine="h5netcdf") as data:
        assert data["position"].dims == ("run", "time", "axis")
        assert data["position"].attrs == {"units": "m", "long_name": "something"}
        for name in expected.variables:
            assert (data[name].values == expected[name]).all(), name
    with netCDF4.Dataset(path) as data:
        assert {name: len(d) for name, d in data.dimensions.items()} == {
            "run": 4,
            "time": SAMPLES,
            "axis": 3,
        }
        for name in expected.variables:
            assert (np.asarray(data[name][:]) == expected[name]).all(), name
        assert data.plan_id == "abc"


def test_the_seal_is_the_digest_of_all_before_it(file):
    path, checksum = file
    content = path.read_bytes()
    assert hashlib.sha256(content[:-SEAL_SIZE]).hexdigest() == checksum.digest == read_seal(path)
    assert checksum == read_checksum(path)
    assert checksum.size == len(content)


def test_the_same_motions_make_the_same_bytes(file, tmp_path):
    again = tmp_path / "another.h5"
    assert write_motions(again, motions()) == file[1]
    assert again.read_bytes() == file[0].read_bytes()


def test_what_stands_behind_the_arrays_is_sealed_too(tmp_path):
    """HDF5 moves a text that is too long for its place to the end of the file."""
    path = tmp_path / "long.h5"
    long = motions()
    long = Motions(long.variables, {f"note_{k}": f"{k}" * 3000 for k in range(9)})
    checksum = write_motions(path, long)
    check_motions(path, checksum)
    assert_same(read_motions(path), long)
    last = path.read_bytes().rindex(long["energy"].tobytes())
    assert checksum.size - last > 2 * long["energy"].nbytes + SEAL_SIZE


def test_numbers_of_many_blocks(tmp_path, monkeypatch):
    whole = tmp_path / "whole.h5"
    write_motions(whole, motions())
    monkeypatch.setattr(motions_file, "_BLOCK", 24)
    parts = tmp_path / "parts.h5"
    write_motions(parts, motions())
    assert parts.read_bytes() == whole.read_bytes()


def test_every_damage_is_noticed(file):
    path, checksum = file
    content = path.read_bytes()
    rng = np.random.default_rng(2)
    for place in (*rng.integers(0, len(content), 40).tolist(), len(content) - 5):
        path.write_bytes(content[:place] + bytes([content[place] ^ 4]) + content[place + 1 :])
        with pytest.raises(NotAResultError, match="damaged"):
            check_motions(path, checksum)
    for length in (0, 10, 2000, len(content) - 1):
        path.write_bytes(content[:length])
        assert read_checksum(path) is None
        with pytest.raises(NotAResultError, match="damaged"):
            check_motions(path, checksum)


def test_another_whole_file_is_not_this_one(file, tmp_path):
    other = tmp_path / "other.h5"
    write_motions(other, motions((3, 5, 8, 10)))
    with pytest.raises(NotAResultError, match="damaged"):
        check_motions(other, file[1])


def test_an_absent_file(tmp_path):
    assert read_checksum(tmp_path / "none.h5") is None
    with pytest.raises(StoreError, match="cannot be read"):
        read_motions(tmp_path / "none.h5")


def test_files_of_others(tmp_path):
    path = tmp_path / "other.h5"
    for kind, version, error in (
        ("sweep", 1, NotAResultError),
        ("traces", 2, NewerSchemaError),
        ("traces", 0, NotAResultError),
    ):
        with h5py.File(path, "w") as file:
            file.attrs.update({"kind": kind, "schema_version": version})
        with pytest.raises(error):
            read_motions(path)


class FullDisk:
    """Writes blocks until the free space, in bytes, is used up; then raises the error."""

    def __init__(self, free):
        self.free = free

    def __call__(self, file, block):
        if len(block) > self.free:
            raise OSError(errno.ENOSPC, "No space left on device")
        self.free -= len(block)
        file.write(block)


@pytest.mark.parametrize("free", [0, 100, 900])
def test_a_disk_that_gets_full(file, monkeypatch, free):
    path, checksum = file
    monkeypatch.setattr(motions_file, "write_all", FullDisk(free))
    with pytest.raises(StoreError, match="No space left"):
        write_motions(path, motions((0, 1, 2, 3)))
    check_motions(path, checksum)
    assert [entry.name for entry in path.parent.iterdir()] == [path.name]


def test_the_seal_is_that_of_the_motions_in_memory(tmp_path, monkeypatch):
    """A disk that spoils a block without an error cannot make a file that passes for whole."""
    path = tmp_path / "a.h5"
    monkeypatch.setattr(motions_file, "_BLOCK", 200)
    for spoiled in itertools.count():
        calls: list[int] = []

        def spoil_one(file, block, calls=calls, spoiled=spoiled):
            calls.append(len(block))
            if len(calls) == spoiled + 1:
                block = bytes(byte ^ 1 for byte in bytes(block))
            file.write(block)

        monkeypatch.setattr(motions_file, "write_all", spoil_one)
        checksum = write_motions(path, motions())
        if spoiled == len(calls):
            break
        with pytest.raises(NotAResultError):
            check_motions(path, checksum)
    assert spoiled > 20
    check_motions(path, checksum)
