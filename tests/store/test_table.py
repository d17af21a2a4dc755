"""Protects sweep files and the folder lock: a file is read as it was written, or refused."""

import errno
import io
import itertools
import os
import subprocess
import sys
import threading

import h5py
import netCDF4
import numpy as np
import pytest
import xarray

from rbstab.store import table_file, table_writer
from rbstab.store.disk.atomic import write_at
from rbstab.store.disk.lock import FolderInUseError, is_locked, locked
from rbstab.store.disk.seal import SEAL_SIZE, add_seal, check_seal
from rbstab.store.errors import NewerSchemaError, NotAResultError, StoreError
from rbstab.store.hdf5_layout import Piece
from rbstab.store.run_file import open_result
from rbstab.store.table import Column, TableHeader
from rbstab.store.table_file import check_table, read_table
from rbstab.store.table_writer import write_table
from rbstab.store.variables import Variable

LAYOUT = {
    "run_id": Column((), "S32", "1", "identity"),
    "status": Column((), "i1", "1", "how it ended", ("completed", "range left")),
    "final_position": Column(("axis",), "f8", "m", "X at the end"),
    "steps": Column((), "i4", "1", "steps"),
}
EXTRAS = {
    "grid_axis": Variable(("grid_axis_number",), np.array(["a", "b"], object), "", "names"),
    "grid_length": Variable(("grid_axis_number",), np.array([3, 4]), "1", "lengths"),
    "plan": Variable((), np.array("title: ö\n", object), "", "plan, YAML"),
}


def arrays_of(start, stop):
    n = np.arange(start, stop)
    return {
        "run_id": np.array([f"{i:032x}".encode() for i in n], dtype="S32"),
        "status": (n % 2).astype("i1"),
        "final_position": np.array([[i, -i / 3, np.nan] for i in n]).reshape(-1, 3),
        "steps": n.astype("i4"),
    }


def same(found, expected):
    assert found.keys() == {*expected, "run"}
    for name, data in expected.items():
        assert found[name].dtype == data.dtype
        assert found[name].tobytes() == data.tobytes()


@pytest.fixture
def segment(tmp_path):
    """A file with seven consecutive members of a sweep."""
    path = tmp_path / "a.h5"
    write_table(path, TableHeader(LAYOUT, 5, 7, {"plan_id": "x", "size": 7}), [arrays_of(5, 12)])
    return path


@pytest.fixture
def sweep(tmp_path):
    """The file of a whole sweep, written in three batches."""
    path = tmp_path / "s.h5"
    batches = (arrays_of(*members) for members in [(0, 5), (5, 6), (6, 12)])
    write_table(path, TableHeader(LAYOUT, 0, 12, {"plan_id": "x"}, EXTRAS), batches)
    return path


def test_a_part_comes_back(segment):
    table = read_table(segment)
    same(table.arrays, arrays_of(5, 12))
    assert table["run"].tolist() == list(range(5, 12))
    assert dict(table.layout) == LAYOUT
    assert table.attributes.items() >= {"plan_id": "x", "size": 7}.items()
    assert table.words("status").tolist()[:2] == ["range left", "completed"]


def test_a_sweep_comes_back(sweep):
    table = read_table(sweep)
    same(table.arrays, arrays_of(0, 12))
    assert table["plan"].item() == "title: ö\n"
    assert table["grid_axis"].tolist() == ["a", "b"]
    assert table.shaped("final_position").shape == (3, 4, 3)
    assert table.shaped("steps")[2, 1] == 9
    assert set(read_table(sweep, ["steps"]).arrays) == {"run", "steps"}


def test_the_digest_of_arrays_does_not_depend_on_how_they_are_cut(sweep, tmp_path):
    write_table(tmp_path / "t.h5", TableHeader(LAYOUT, 0, 12, {"other": 1}), [arrays_of(0, 12)])
    digests = [read_table(path).attributes["arrays_digest"] for path in (sweep, tmp_path / "t.h5")]
    assert digests[0] == digests[1]
    changed = arrays_of(0, 12)
    changed["final_position"][7, 1] = np.nextafter(changed["final_position"][7, 1], 1)
    write_table(tmp_path / "t.h5", TableHeader(LAYOUT, 0, 12, {}), [changed])
    assert read_table(tmp_path / "t.h5").attributes["arrays_digest"] != digests[0]


def test_xarray_and_others_open_it(sweep, segment):
    for path, length in ((sweep, 12), (segment, 7)):
        with xarray.open_dataset(path, engine="h5netcdf") as data:
            assert data.sizes["run"] == length
            assert data["final_position"].dims == ("run", "axis")
            assert data["final_position"].attrs["units"] == "m"
            assert data["status"].attrs["flag_meanings"] == "completed range_left"
            assert data["status"].attrs["flag_values"].tolist() == [0, 1]
            first = data["run_id"].values[0]
            assert first in (f"{12 - length:032x}", f"{12 - length:032x}".encode())
        with netCDF4.Dataset(path) as data:
            assert data["final_position"].dimensions == ("run", "axis")
            assert data["steps"][:].tolist() == arrays_of(12 - length, 12)["steps"].tolist()
        with h5py.File(path) as data:
            assert data["run_id"].dtype == "S32"
    assert read_table(segment).to_xarray()["steps"].sel(run=7).item() == 7
    ours = read_table(sweep).to_xarray()
    assert (ours["steps"].dims, ours["steps"].isel(a=1, b=3).item()) == (("a", "b"), 7)


def test_any_damage_is_noticed(segment):
    content = segment.read_bytes()
    rng = np.random.default_rng(1)
    for at in [0, len(content) - 1, *rng.integers(0, len(content), 60).tolist()]:
        segment.write_bytes(content[:at] + bytes([content[at] ^ 4]) + content[at + 1 :])
        with pytest.raises(NotAResultError):
            read_table(segment)
    for size in (0, 10, SEAL_SIZE, len(content) // 2, len(content) - 1):
        segment.write_bytes(content[:size])
        with pytest.raises(NotAResultError):
            read_table(segment)
    segment.write_bytes(content + b"\n")
    with pytest.raises(NotAResultError):
        read_table(segment)


def test_other_files(tmp_path, segment):
    path = tmp_path / "b.h5"
    with pytest.raises(StoreError, match="No such file"):
        read_table(path)
    path.write_bytes(add_seal(b"something"))
    with pytest.raises(NotAResultError):
        read_table(path)
    for version, error in ((2, NewerSchemaError), ("1", NotAResultError)):
        path.write_bytes(segment.read_bytes()[:-SEAL_SIZE])
        with h5py.File(path, "r+") as file:
            file.attrs["schema_version"] = version
        path.write_bytes(add_seal(path.read_bytes()))
        with pytest.raises(error):
            read_table(path)
    with pytest.raises(NotAResultError):
        open_result(segment)


def test_a_full_disk(tmp_path, monkeypatch, sweep):
    before = sweep.read_bytes()

    def full(descriptor):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(StoreError, match="No space left"):
            write_table(sweep, TableHeader(LAYOUT, 0, 2, {}), [arrays_of(0, 2)])
    assert sweep.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["s.h5"]


def refusal_of(function, *arguments):
    """Return the message of the store error that a function raises; None if it raises none."""
    try:
        function(*arguments)
    except StoreError as error:
        return str(error)
    return None


def test_a_disk_that_spoils_a_write_makes_no_table(tmp_path, monkeypatch, sweep):
    """Each write of each column, of `run`, of the metadata and of the seal is compared."""
    before = sweep.read_bytes()
    header = TableHeader(LAYOUT, 0, 12, {"plan_id": "y"}, EXTRAS)
    for spoiled in itertools.count():
        calls: list[int] = []

        def spoil_one(file, offset, content, calls=calls, spoiled=spoiled):
            calls.append(offset)
            if len(calls) == spoiled + 1:
                content = bytes(byte ^ 1 for byte in bytes(content))
            write_at(file, offset, content)

        monkeypatch.setattr(table_writer, "write_at", spoil_one)
        refusal = refusal_of(write_table, sweep, header, [arrays_of(0, 5), arrays_of(5, 12)])
        if refusal is None:
            break
        assert "the disk returned other bytes than were written" in refusal
        assert sweep.read_bytes() == before
        assert [path.name for path in tmp_path.iterdir()] == ["s.h5"]
    assert spoiled == len(calls) > 2 * len(LAYOUT) + 4
    assert read_table(sweep).attributes["plan_id"] == "y"


def test_a_table_of_many_blocks_is_read_back(tmp_path, monkeypatch, sweep):
    whole = sweep.read_bytes()
    monkeypatch.setattr(table_writer, "_BLOCK", 24)
    header = TableHeader(LAYOUT, 0, 12, {"plan_id": "x"}, EXTRAS)
    write_table(sweep, header, [arrays_of(0, 7), arrays_of(7, 12)])
    assert sweep.read_bytes() == whole


def test_a_file_that_became_shorter_is_noticed():
    with pytest.raises(OSError, match="other bytes than were written"):
        list(table_writer._blocks(io.BytesIO(b"12"), Piece(0, 5, None, b"12345")))


@pytest.mark.parametrize("name", ["run", "run_id", "final_position", "steps", "plan"])
def test_a_file_that_was_sealed_with_a_wrong_array_is_refused(sweep, name):
    """Earlier versions sealed what they found on the disk."""
    content = bytearray(sweep.read_bytes()[:-SEAL_SIZE])
    with h5py.File(io.BytesIO(content), "r") as file:
        at = file[name].id.get_offset()
    if name == "plan":
        at = content.index("title: ö".encode())
    content[at] ^= 1
    sweep.write_bytes(add_seal(bytes(content)))
    check_seal(sweep)
    for columns in (None, [], ["status"]):
        with pytest.raises(NotAResultError):
            read_table(sweep, columns)
    with pytest.raises(NotAResultError):
        check_table(sweep)


def test_a_checked_file_is_not_compared_again(sweep, monkeypatch):
    """Another process has done so. What it has checked is the file, and not its name."""
    os.utime(sweep, (1, 1))
    checked = check_table(sweep)
    assert checked.layout.keys() == LAYOUT.keys()
    compared = []
    check_digests = table_file._check_digests

    def counted(*parts):
        compared.append(1)
        check_digests(*parts)

    monkeypatch.setattr(table_file, "_check_digests", counted)
    assert checked.identity is not None
    table_file.count_as_checked(checked.identity)
    read_table(sweep)
    assert compared == []
    os.utime(sweep, (2, 2))
    read_table(sweep)
    assert compared == [1]


def test_a_new_file_may_change_again_so_it_counts_as_not_checked(sweep):
    assert check_table(sweep).identity is None


def test_no_status_without_a_meaning_is_read(tmp_path):
    arrays = arrays_of(0, 4) | {"status": np.array([0, 1, 2, 0], "i1")}
    write_table(tmp_path / "t.h5", TableHeader(LAYOUT, 0, 4, {}), [arrays])
    with pytest.raises(NotAResultError, match="status has a flag without a meaning"):
        read_table(tmp_path / "t.h5")
    with pytest.raises(NotAResultError, match="status has a flag without a meaning"):
        check_table(tmp_path / "t.h5")
    assert read_table(tmp_path / "t.h5", ["steps"])["steps"].tolist() == [0, 1, 2, 3]


def test_a_changed_file_is_compared_again(sweep):
    """A process remembers the files that it has compared with their digests."""
    os.utime(sweep, (1, 1))
    for _ in range(2):
        read_table(sweep)
    content = bytearray(sweep.read_bytes())
    content[len(content) // 2] ^= 1
    sweep.write_bytes(content)
    os.utime(sweep, (1, 1))
    with pytest.raises(NotAResultError):
        read_table(sweep)


def test_threads_may_write_at_once(tmp_path):
    def write(index):
        for k in range(5):
            path = tmp_path / f"{index}-{k}.h5"
            write_table(path, TableHeader(LAYOUT, index, 50, {}), [arrays_of(index, index + 50)])

    threads = [threading.Thread(target=write, args=(i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for path in tmp_path.iterdir():
        index = int(path.name[0])
        same(read_table(path).arrays, arrays_of(index, index + 50))


HOLDER = """
import sys
from pathlib import Path
from rbstab.store.hdf5_layout import Piece
from rbstab.store.disk.lock import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.readline()
"""


def test_the_lock(tmp_path):
    assert not is_locked(tmp_path)
    with locked(tmp_path), pytest.raises(FolderInUseError, match="in use"), locked(tmp_path):
        pass
    command = [sys.executable, "-c", HOLDER, str(tmp_path)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        assert is_locked(tmp_path)
        with pytest.raises(FolderInUseError), locked(tmp_path):
            pass
        holder.kill()
        holder.wait()
    assert not is_locked(tmp_path)
    with locked(tmp_path):
        assert is_locked(tmp_path)
