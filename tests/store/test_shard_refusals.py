"""Protects against shards with a right seal and wrong content; each is refused with its reason."""

import json

import numpy as np
import pytest

from rbstab.store.disk.seal import SEAL_SIZE, add_seal
from rbstab.store.errors import NewerSchemaError, NotAResultError
from rbstab.store.shard_file import read_shard, write_shard
from rbstab.store.table import Column, TableHeader

LAYOUT = {
    "status": Column((), "i1", "1", "end", ("completed", "range left")),
    "steps": Column((), "i4", "1", "steps"),
}
ARRAYS = {"status": np.array([0, 1, 0], "i1"), "steps": np.array([4, 5, 6], "i4")}


@pytest.fixture
def shard(tmp_path):
    """A function that writes a shard with these attributes, changed by a function of its bytes."""
    path = tmp_path / "0.npy"

    def write(change=lambda content: content, arrays=ARRAYS, **attributes):
        write_shard(path, TableHeader(LAYOUT, 0, 3, attributes), arrays)
        path.write_bytes(add_seal(change(path.read_bytes()[:-SEAL_SIZE])))
        return path

    return write


def refusal(path, layout=None, kind=NotAResultError):
    with pytest.raises(kind) as caught:
        read_shard(path, LAYOUT if layout is None else layout)
    return str(caught.value).removeprefix(f"{path} ")


def replacing(old, new):
    def change(content):
        assert content.count(old) == 1
        return content.replace(old, new)

    return change


def with_attributes(line):
    return lambda content: content[: content.rindex(b"\n") + 1] + line.encode()


def test_a_header_that_names_more_members_than_there_are(shard):
    path = shard(replacing(b"(3,)", b"(9,)"))
    assert refusal(path) == "is damaged: it has fewer members than its header says"


def test_a_header_that_names_fewer_members(shard):
    assert refusal(shard(replacing(b"(3,)", b"(2,)"))) == "is not a shard of a sweep"


@pytest.mark.parametrize("left", ["", "\n"])
def test_no_attributes(shard, left):
    def cut(content):
        return content[: content.rindex(b"\n")] + left.encode()

    assert refusal(shard(cut)) == "is not a shard of a sweep"


@pytest.mark.parametrize(
    "line",
    [
        '{"schema_version": "1"}',
        '{"schema_version": 1.0}',
        '{"schema_version": true}',
        '{"schema_version": null}',
        '{"schema_version": 1, "a": null}',
        '{"schema_version": 1, "a": true}',
        '{"schema_version": 1, "a": [1]}',
        '{"schema_version": 1, "a": "x", "b": {}}',
    ],
)
def test_attributes_of_wrong_types(shard, line):
    path = shard(with_attributes(line))
    assert refusal(path) == "is damaged: its attributes have wrong types"


@pytest.mark.parametrize("line", ["[]", "1", '"a"', "{}", '{"a": 1}', "{", "\xff", "[" * 60_000])
def test_what_are_no_attributes(shard, line):
    assert refusal(shard(with_attributes(line))) == "is not a shard of a sweep"


def test_a_newer_version(shard):
    path = shard(with_attributes('{"schema_version": 2}'))
    reason = "was written by a newer rbstab; update rbstab"
    assert refusal(path, kind=NewerSchemaError) == reason


def test_attributes_of_up_to_64_kibibytes(shard):
    """The line break before them counts."""
    empty = len(json.dumps({"schema_version": 1, "a": ""}))
    text = "x" * ((1 << 16) - 1 - empty)
    assert read_shard(shard(a=text), LAYOUT).attributes["a"] == text
    assert refusal(shard(a=text + "x")) == "is not a shard of a sweep"


OTHERS = {
    "another type of the same size": LAYOUT | {"steps": Column((), "f4", "1", "steps")},
    "another name": {"status": LAYOUT["status"], "count": LAYOUT["steps"]},
    "another order": {"steps": LAYOUT["steps"], "status": LAYOUT["status"]},
    "one less": {"status": LAYOUT["status"]},
    "one more": LAYOUT | {"more": Column((), "i4", "1", "more")},
}


@pytest.mark.parametrize("name", OTHERS)
def test_other_columns(shard, name):
    assert refusal(shard(), OTHERS[name]) == "has other columns than a shard of this rbstab"


def test_a_status_without_a_meaning(shard):
    path = shard(arrays=ARRAYS | {"status": np.array([0, 2, 0], "i1")})
    assert refusal(path) == "is damaged: status has a flag without a meaning"


def test_members_that_are_not_in_order(shard):
    first, second = (np.array([number], "<i8").tobytes() for number in (1, 2))
    entry = np.array([5], "<i4").tobytes()

    def change(content):
        at = content.index(entry) - 1 - 8
        assert content[at : at + 8] == first
        return content[:at] + second + content[at + 8 :]

    assert refusal(shard(change)) == "is damaged: run does not count the runs"
