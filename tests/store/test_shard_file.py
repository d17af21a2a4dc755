"""Protects shard files: they come back unchanged, damage is noticed, and numpy opens them."""

import json

import numpy as np
import pytest

from rbstab.store.disk.seal import SEAL_SIZE, add_seal
from rbstab.store.errors import NewerSchemaError, NotAResultError, StoreError
from rbstab.store.shard_file import DIGEST, read_shard, write_shard
from rbstab.store.table import Column, TableHeader

LAYOUT = {
    "id": Column((), "S4", "1", "identity"),
    "status": Column((), "i1", "1", "end", ("completed", "range left")),
    "peak": Column(("axis",), "f8", "m", "largest"),
    "steps": Column((), "i4", "1", "steps"),
}


def arrays_of(first, stop):
    numbers = np.arange(first, stop)
    return {
        "id": np.array([f"{n:04d}" for n in numbers], dtype="S4"),
        "status": (numbers % 2).astype("i1"),
        "peak": np.stack([0.1 * numbers, np.full(len(numbers), -np.inf), -numbers / 3.0], axis=1),
        "steps": numbers.astype("i4"),
    }


@pytest.fixture
def shard(tmp_path):
    path = tmp_path / "a.npy"
    write_shard(path, TableHeader(LAYOUT, 5, 7, {"plan_id": "x", "size": 7}), arrays_of(5, 12))
    return path


def test_a_shard_comes_back(shard):
    table = read_shard(shard, LAYOUT)
    for name, expected in arrays_of(5, 12).items():
        np.testing.assert_array_equal(table[name], expected)
        assert table[name].dtype == np.dtype(LAYOUT[name].dtype)
    assert table["run"].tolist() == [5, 6, 7, 8, 9, 10, 11]
    assert table.attributes["plan_id"] == "x"
    assert table.attributes["size"] == 7
    assert table.words("status").tolist()[:2] == ["range left", "completed"]


def test_the_digest_is_that_of_the_content(shard, tmp_path):
    other = tmp_path / "b.npy"
    digest = write_shard(
        other, TableHeader(LAYOUT, 5, 7, {"size": 7, "plan_id": "x"}), arrays_of(5, 12)
    )
    assert digest == read_shard(shard, LAYOUT).attributes[DIGEST]
    changed = arrays_of(5, 12)
    changed["steps"][3] += 1
    assert write_shard(other, TableHeader(LAYOUT, 5, 7, {}), changed) != digest


def test_numpy_opens_it(shard):
    entries = np.load(shard)
    assert entries["steps"].tolist() == list(range(5, 12))
    assert entries["run"][0] == 5


def test_any_damage_is_noticed(shard):
    content = shard.read_bytes()
    rng = np.random.default_rng(0)
    for at in rng.integers(0, len(content), 60).tolist():
        shard.write_bytes(content[:at] + bytes([content[at] ^ 4]) + content[at + 1 :])
        with pytest.raises(NotAResultError, match="damaged"):
            read_shard(shard, LAYOUT)
    for size in (0, 1, SEAL_SIZE - 1, SEAL_SIZE, len(content) // 2, len(content) - 1):
        shard.write_bytes(content[:size])
        with pytest.raises(NotAResultError):
            read_shard(shard, LAYOUT)
    shard.write_bytes(content + b"\n")
    with pytest.raises(NotAResultError):
        read_shard(shard, LAYOUT)


def test_other_content_under_a_right_seal(tmp_path, shard):
    path = tmp_path / "c.npy"
    inner = shard.read_bytes()[:-SEAL_SIZE]
    array, _, _ = inner.rpartition(b"\n")
    newer = array + b"\n" + json.dumps({"schema_version": 2}).encode()
    path.write_bytes(add_seal(newer))
    with pytest.raises(NewerSchemaError):
        read_shard(path, LAYOUT)
    for content in (b"", b"hello", array, array + b"\n[]", array + b"\n{}", array + b"\n{"):
        path.write_bytes(add_seal(content))
        with pytest.raises(NotAResultError):
            read_shard(path, LAYOUT)


def test_nothing_is_unpickled(tmp_path):
    path = tmp_path / "c.npy"
    np.save(path, np.array([{"a": 1}], dtype=object), allow_pickle=True)
    path.write_bytes(add_seal(path.read_bytes() + b'\n{"schema_version": 1}'))
    with pytest.raises(NotAResultError):
        read_shard(path, LAYOUT)


def test_what_cannot_be_written_or_read(tmp_path):
    with pytest.raises(StoreError, match="written"):
        write_shard(tmp_path / "no" / "a.npy", TableHeader(LAYOUT, 0, 2, {}), arrays_of(0, 2))
    with pytest.raises(StoreError, match="read"):
        read_shard(tmp_path / "no.npy", LAYOUT)
