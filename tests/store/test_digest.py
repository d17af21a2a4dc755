"""Protects the digest of a result: it changes with the content and with nothing else."""

import dataclasses

import h5py
import numpy as np
import pytest
from support.results import result

from rbstab.store.digest import digest_of
from rbstab.store.errors import NotAResultError
from rbstab.store.run_file import open_result, write_result


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
