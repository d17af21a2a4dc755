"""Protects the one file format: what is written is read, by others too; all else is refused."""

import hashlib
import itertools
import json
import re
import subprocess
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import netCDF4
import numpy as np
import pytest
import xarray
from support.results import AWKWARD, sealed

from rbstab.store import dataset_file
from rbstab.store.dataset import Dataset
from rbstab.store.dataset_file import checksum_of, read_dataset, write_dataset
from rbstab.store.disk import seal
from rbstab.store.disk.seal import SEAL_SIZE
from rbstab.store.errors import NewerSchemaError, NotAResultError, ResultExistsError, StoreError
from rbstab.store.variables import Variable

KIND = "a test"
CODES = np.array([0, 1, 1, 0], "i1")
NUMBERS = np.array([*AWKWARD, 2.5, -7.0, 1e-9]).reshape(4, 3)
TRACKED = h5py.h5p.CRT_ORDER_TRACKED | h5py.h5p.CRT_ORDER_INDEXED


def dataset(first=3, **attributes):
    """Return arrays of all types, dimensions and lengths that results have."""
    words = np.array(["kinetic", "Feder µ\nb"], dtype=object)
    variables = {
        "position": Variable(("run", "axis"), NUMBERS if first == 3 else NUMBERS + first, "m", "X"),
        "run": Variable(("run",), np.arange(first, first + 4), "1", "number"),
        "part": Variable(("part",), words, "1", "parts"),
        "energy": Variable(("run", "part"), np.arange(8.0).reshape(4, 2), "J", "energy"),
        "status": Variable(("run",), CODES, "1", "end", ("completed", "range left")),
        "id": Variable(("run",), np.array([b"ab", b"c", b"", b"dddd"], "S4"), "1", "identity"),
        "count": Variable(("run",), np.array([1, -2, 3, 4], "i4"), "1", "count"),
        "at_rest": Variable((), np.array(-1e-300), "J", "-h"),
        "switches": Variable(("switch",), np.zeros(0), "s", "none"),
        "plan": Variable((), np.array("title: ö\n", dtype=object), "", "plan"),
        "certificate/check": Variable(("check",), words[::-1], "1", "checks"),
        "certificate/value": Variable(("check",), np.array([1.0, np.nan]), "1", "values"),
    }
    given = {"title": "Fall – θ", "steps": 2**40, "x": 0.1, **attributes}
    return Dataset(variables, given, kind=KIND)


def changed(name, **fields):
    """Return that dataset with a changed array."""
    whole = dataset()
    new = {name: whole.variables[name]._replace(**fields)}
    return replace(whole, variables={**whole.variables, **new})


def same(actual, expected):
    assert (actual.kind, dict(actual.attributes)) == (expected.kind, dict(expected.attributes))
    assert list(actual.variables) == list(expected.variables)
    for name, v in expected.variables.items():
        other = actual.variables[name]
        assert (other.dimensions, *other[2:]) == (v.dimensions, *v[2:]), name
        assert (other.data.dtype, other.data.shape) == (v.data.dtype, v.data.shape), name
        if v.is_text:
            assert other.data.tolist() == v.data.tolist(), name
        else:
            assert other.data.tobytes() == v.data.tobytes(), name


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "a.h5"
    write_dataset(path, dataset())
    return path


def test_what_is_written_is_read(file):
    same(read_dataset(file, KIND), dataset())


def test_some_arrays_of_some_runs(file):
    """Arrays that are not along `run` are always read."""
    some: Dataset = read_dataset(file, KIND, ["energy"])
    assert set(dataset()) - set(some) == {"position", "status", "id", "count"}
    whole: Dataset = read_dataset(file, KIND, row=2)
    arrays = whole.variables
    assert arrays["position"].data.tolist() == NUMBERS[2].tolist()
    assert arrays["position"].dimensions == ("axis",)
    assert arrays["run"].data == 5
    assert arrays["part"].dimensions == ("part",)


def test_other_readers(file):
    expected = dataset().variables
    with xarray.open_dataset(file, engine="h5netcdf") as data:
        assert data["position"].dims == ("run", "axis")
        assert data["position"].attrs["units"] == "m"
        assert data["status"].attrs["flag_meanings"] == "completed range_left"
        assert data["axis"].values.tolist() == [1, 2, 3]
        assert np.array_equal(data["position"], expected["position"].data, equal_nan=True)
        assert (data.attrs["kind"], data.attrs["format"]) == (KIND, 1)
    with netCDF4.Dataset(file) as data:
        sizes = {"run": 4, "axis": 3, "part": 2, "switch": 0}
        assert {name: len(dimension) for name, dimension in data.dimensions.items()} == sizes
        assert data["plan"][...] == "title: ö\n"
        assert data["certificate"]["check"][:].tolist() == ["Feder µ\nb", "kinetic"]
    with h5py.File(file) as data:
        for name, v in expected.items():
            # Every reader can map the arrays: no unlimited dimension, no compression, no chunks.
            assert data[name].maxshape == data[name].shape
            assert data[name].chunks is None
            if not v.is_text:
                assert data[name][()].tobytes() == v.data.tobytes(), name
            for axis, length in zip(data[name].dims, v.data.shape, strict=True):
                assert data[name].is_scale or len(axis[0]) == length, name
        for name in ("run", "axis", "part", "certificate/check"):
            assert h5py.h5ds.get_scale_name(data[name].id) == name.rpartition("/")[2].encode()
        groups = [h5py.h5g.open(data.id, name) for name in (b"/", b"certificate")]
        assert [g.get_create_plist().get_link_creation_order() for g in groups] == [TRACKED] * 2
        orders = [data[name].id.get_create_plist().get_attr_creation_order() for name in expected]
        assert orders == [TRACKED] * len(expected)


def test_reading_needs_no_hdf5(file):
    """On a damaged file it may hang, crash, or fill the memory."""
    code = (
        "import sys; from pathlib import Path; from rbstab.store.dataset_file import read_dataset\n"
        f"read_dataset(Path({str(file)!r}), {KIND!r}); print('h5py' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


OTHERS = {
    "other numbers": dataset(7),
    "other attribute": dataset(x=0.2),
    "1 in place of 1.0": dataset(x=1),
    "other unit": changed("energy", unit="kJ"),
    "other text": changed("plan", data=np.array("title: b", dtype=object)),
}


@pytest.mark.parametrize("name", OTHERS)
def test_a_file_does_not_depend_on_the_one_before(tmp_path, monkeypatch, name):
    """The layout is kept for the next file; all bytes are those of a new layout."""
    monkeypatch.setattr(dataset_file, "_last", {})
    write_dataset(tmp_path / "0.h5", dataset(x=1.0) if name.startswith("1 ") else dataset())
    write_dataset(tmp_path / "1.h5", OTHERS[name])
    monkeypatch.setattr(dataset_file, "_last", {})
    write_dataset(tmp_path / "2.h5", OTHERS[name])
    assert (tmp_path / "1.h5").read_bytes() == (tmp_path / "2.h5").read_bytes()
    same(read_dataset(tmp_path / "1.h5", KIND), OTHERS[name])


def test_the_seal_is_the_digest_of_all_before_it(file):
    content = file.read_bytes()
    digest = hashlib.sha256(content[:-SEAL_SIZE]).hexdigest()
    assert checksum_of(file) == checksum_of(file, check=True) == (digest, len(content))
    assert read_dataset(file, KIND).digest == digest
    assert re.fullmatch(rb"\nrbstab format 001 sha256 [0-9a-f]{64}\n", content[-SEAL_SIZE:])


def test_every_damage_is_noticed(file):
    content = file.read_bytes()
    for at in range(0, len(content), len(content) // 200):
        file.write_bytes(content[:at] + bytes([content[at] ^ 4]) + content[at + 1 :])
        with pytest.raises((NotAResultError, NewerSchemaError)):
            read_dataset(file, KIND)
    for length in (0, 1, SEAL_SIZE - 1, SEAL_SIZE, 2000, len(content) - 1):
        file.write_bytes(content[:length])
        with pytest.raises(NotAResultError):
            read_dataset(file, KIND)
        file.write_bytes(content[:length] + bytes(len(content) - length))
        with pytest.raises(NotAResultError):
            read_dataset(file, KIND)
    file.write_bytes(content + b"\n")
    with pytest.raises(NotAResultError):
        read_dataset(file, KIND)
    file.write_bytes(content)
    same(read_dataset(file, KIND), dataset())


@pytest.mark.parametrize("age", ["old", "just written"])
def test_a_file_is_compared_with_its_seal_again_when_it_changed(file, monkeypatch, age):
    """Two changes of a new file within a tick of the system's clock look alike."""
    monkeypatch.setattr(seal, "_unchanged", set())
    if age == "old":
        monkeypatch.setattr(seal, "MIN_AGE", -1e9)
    else:
        monkeypatch.setattr(seal, "identity_of", lambda _: (1,))
    for _ in range(3):
        read_dataset(file, KIND)
    assert len(seal._unchanged) == (age == "old")
    if age == "old":
        with monkeypatch.context() as patch:
            patch.setattr("rbstab.store.disk.seal.hashlib.sha256", bytearray)  # no digest
            read_dataset(file, KIND)
    content = bytearray(file.read_bytes())
    content[content.index(NUMBERS.tobytes())] ^= 1
    file.write_bytes(content)
    with pytest.raises(NotAResultError, match="does not match its digest"):
        read_dataset(file, KIND)


def refused(path, kind=KIND):
    with pytest.raises(StoreError) as caught:
        read_dataset(path, kind)
    return caught.type, str(caught.value)


def test_what_is_no_such_file(file, tmp_path):
    assert refused(file, "a run") == (NotAResultError, f"{file} is a test, not a run")
    content = file.read_bytes()
    bare = content[:-SEAL_SIZE]
    old = b"\nrbstab sha256 " + b"0" * 64 + b"\n"
    made_before = "was made before the first release; run its config again."
    cases = {
        b"": "has no seal of rbstab",
        b"time: 1\n": "has no seal of rbstab",
        bare: "has no seal of rbstab",
        bare + old: made_before,
        bare + b"\nrbstab format 002 sha256 " + b"0" * 64 + b"\n": "was written by a newer rbstab",
        b"!" + content: "is damaged: its content does not match its digest",
    }
    for changed, message in cases.items():
        file.write_bytes(changed)
        kind, text = refused(file)
        assert text.startswith(f"{file} {message}")
        assert text.endswith(". Without this check, h5py may still read it") != ("newer" in message)
        assert (kind is NewerSchemaError) == ("newer" in message)
    missing = tmp_path / "none.h5"
    assert refused(missing) == (StoreError, f"{missing} cannot be read: No such file or directory")
    assert refused(tmp_path) == (StoreError, f"{tmp_path} cannot be read: Is a directory")
    assert refused(file / "b") == (StoreError, f"{file / 'b'} cannot be read: Not a directory")


def test_a_flipped_bit_of_any_byte_is_refused(tmp_path):
    """One bit of each byte of the smallest file, and all bits of its seal."""
    path = tmp_path / "least.h5"
    size = write_dataset(path, Dataset({}, {}, kind=KIND)).size
    content = path.read_bytes()
    assert len(content) == size
    read_dataset(path, KIND)
    flips = {(place, place % 8) for place in range(size)}
    flips |= set(itertools.product(range(size - SEAL_SIZE, size), range(8)))
    accepted = []
    # Changed in place: to write a new file for each takes a hundred times as long.
    with path.open("r+b", buffering=0) as changed:
        for place, bit in sorted(flips):
            changed.seek(place)
            changed.write(bytes([content[place] ^ 1 << bit]))
            with suppress(NotAResultError, NewerSchemaError):
                read_dataset(path, KIND)
                accepted.append((place, bit))
            changed.seek(place)
            changed.write(content[place : place + 1])
    read_dataset(path, KIND)
    assert accepted == []


def write_index(path, change):
    """Give a file another index under a right seal, which anybody can make."""
    content = path.read_bytes()[:-SEAL_SIZE]
    start = content.rindex(b"\n")
    index = change(json.loads(content[start:]))
    text = index if isinstance(index, bytes) else json.dumps(index).encode()
    path.write_bytes(sealed(content[:start] + b"\n" + text))


ENERGY = {"energy": 1}

# Entries of the index of the array `energy`, or another index.
HOSTILE: dict[str, Any] = {
    "larger than the file": {"shape": [4, 10**6]},
    "larger than any memory": {"shape": [2**40, 2**40]},
    "a negative length": {"shape": [-4, -2]},
    "a negative offset": {"offset": -8},
    "no offset": {"offset": None},
    "pickled objects": {"type": "|O8"},
    "records": {"type": "<f8,<i4"},
    "too few texts": {"texts": ["a"]},
    "an array that is no mapping": lambda index: index | {"arrays": ENERGY},
    "arrays that are a list": lambda index: index | {"arrays": [1]},
    "an attribute that is a list": lambda index: index | {"attributes": {"a": [1]}},
    "a list": lambda _: [1, 2],
    "nothing": lambda _: b"",
    "deep nesting": lambda _: b"[" * 100_000,
    "no text": lambda _: b"\xff\xfe",
    "no JSON": lambda _: b"NaN",
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_with_a_right_seal_are_refused(file, name):
    """What a file says of its arrays is checked before memory is used."""
    change = HOSTILE[name]

    def changed_entries(index: Any) -> Any:
        entries = index["arrays"]["part" if "texts" in change else "energy"]
        entries |= change
        return index

    write_index(file, change if callable(change) else changed_entries)
    kind, text = refused(file)
    assert kind is NotAResultError
    assert text.startswith(f"{file} is damaged")
    # No memory is asked for.
    assert not name.startswith("larger") or "an array is larger than the file" in text


def test_a_long_index_is_read(tmp_path):
    """Its begin is looked for from the end of the file, in ever longer parts."""
    for length in (10, 2**15 - 400, 2**15, 2**17, 10**6):
        long = Dataset({}, {"text": "é" * length}, kind=KIND)
        write_dataset(tmp_path / "a.h5", long, replace=True)
        same(read_dataset(tmp_path / "a.h5", KIND), long)


@pytest.mark.parametrize("shape", [(4, 1), (3, 2), (4,), (1, 2), (4, 2, 1)])
def test_arrays_that_do_not_fit_their_dimensions_are_refused(tmp_path, shape):
    """HDF5 and numpy stretch some."""
    with pytest.raises(StoreError, match="energy has"):
        write_dataset(tmp_path / "a.h5", changed("energy", data=np.zeros(shape)))
    assert not list(tmp_path.iterdir())


def test_files_that_cannot_be_written(file, tmp_path):
    before = file.read_bytes()

    def message(path: Path, *, replace: bool = False) -> str:
        with pytest.raises(StoreError) as caught:
            write_dataset(path, dataset(), replace=replace)
        return str(caught.value)

    with pytest.raises(ResultExistsError):
        write_dataset(file, dataset())
    folder = tmp_path / "folder"
    folder.mkdir()
    assert message(folder, replace=True) == f"{folder} cannot be written: Is a directory"
    below = file / "b.h5"
    assert message(below) == f"{below} cannot be written: Not a directory"
    assert message(tmp_path / ("x" * 300)).endswith("cannot be written: File name too long")
    assert sorted(tmp_path.iterdir()) == [file, folder]
    assert file.read_bytes() == before


def test_a_spoiled_block_cannot_make_a_file_that_passes_for_whole(tmp_path, monkeypatch):
    """The seal is that of the arrays in memory, and not of what the disk has made of them."""
    path = tmp_path / "a.h5"
    monkeypatch.setattr(seal, "_BLOCK", 700)
    for spoiled in itertools.count():
        calls: list[int] = []

        def spoil_one(file, block, calls=calls, spoiled=spoiled):
            calls.append(len(block))
            if len(calls) == spoiled + 1:
                block = bytes(byte ^ 1 for byte in bytes(block))
            file.write(block)

        monkeypatch.setattr(seal, "write_all", spoil_one)
        write_dataset(path, dataset(), replace=True)
        if spoiled == len(calls):
            break
        with pytest.raises((NotAResultError, NewerSchemaError)):
            read_dataset(path, KIND)
    assert spoiled > 20
    same(read_dataset(path, KIND), dataset())
