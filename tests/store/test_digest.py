"""Protects the digest of a result: it changes with the content and with nothing else."""

import dataclasses

import h5py
import numpy as np
import pytest
from support.results import result

from rbstab.store.digest import digest_of, digest_of_table
from rbstab.store.errors import NotAResultError
from rbstab.store.run_file import open_result, write_result
from rbstab.store.table import TableHeader


def test_the_digest_is_stored(tmp_path):
    write_result(tmp_path / "a.h5", result())
    with h5py.File(tmp_path / "a.h5") as file:
        assert file.attrs["digest"] == digest_of(result())


@pytest.mark.parametrize(
    ("name", "value"), [("status", "diverged"), ("title", ""), ("run_id", "1" * 32), ("steps", 1)]
)
def test_a_changed_attribute_is_noticed(tmp_path, name, value):
    path = tmp_path / "a.h5"
    write_result(path, result())
    with h5py.File(path, "r+") as file:
        file.attrs[name] = value
    with pytest.raises(NotAResultError, match="does not match its digest"):
        open_result(path)


def test_every_part_of_a_variable_counts():
    original = result()
    v = original.variables["lyapunov"]
    changes = [
        v._replace(data=v.data * (1 + 2e-16)),
        v._replace(data=v.data.reshape(1, -1)),
        v._replace(unit="kJ"),
        v._replace(long_name="w"),
        v._replace(dimensions=("axis",)),
    ]
    changed = [
        dataclasses.replace(original, variables=original.variables | {"lyapunov": c})
        for c in changes
    ]
    assert len({digest_of(r) for r in [original, *changed]}) == len(changes) + 1


def test_the_layout_in_memory_does_not_count():
    """The same numbers in another byte order or memory order are the same result."""
    original = result()
    energy, v = original.variables["energy"], original.variables["lyapunov"]
    other = original.variables | {
        "energy": energy._replace(data=np.asfortranarray(energy.data)),
        "lyapunov": v._replace(data=v.data.astype(">f8")),
    }
    assert digest_of(dataclasses.replace(original, variables=other)) == digest_of(original)


def test_every_bit_of_a_number_counts():
    """Even those of numbers that are written alike, as NaNs are."""
    original = result()
    v = original.variables["lyapunov"]
    digests = set()
    for bits in (0x7FF8000000000000, 0x7FF8000000000001, 0xFFF8000000000000):
        data = v.data.copy()
        data[2] = np.array(bits, np.uint64).view(np.float64)
        variables = original.variables | {"lyapunov": v._replace(data=data)}
        digests.add(digest_of(dataclasses.replace(original, variables=variables)))
    assert len(digests) == 3


def test_the_order_of_names_does_not_count():
    original = result()
    attributes = dict(reversed(original.attributes.items()))
    variables = dict(reversed(original.variables.items()))
    other = dataclasses.replace(original, attributes=attributes, variables=variables)
    assert list(other.attributes) != list(original.attributes)
    assert digest_of(other) == digest_of(original)
    headers = [TableHeader({}, 0, 1, run.attributes, run.variables) for run in (original, other)]
    digests = {digest_of_table(header, "0" * 64) for header in headers}
    assert len(digests) == 1


def test_every_part_of_a_table_counts():
    header = TableHeader({}, 0, 2, {"a": 1}, {"time": result().variables["time"]})
    changed = [
        header._replace(first=1),
        header._replace(length=3),
        header._replace(attributes={"a": 2}),
        header._replace(attributes={"b": 1}),
        header._replace(extras={}),
    ]
    digests = {digest_of_table(h, "0" * 64) for h in (header, *changed)}
    digests.add(digest_of_table(header, "1" * 64))
    assert len(digests) == len(changed) + 2
