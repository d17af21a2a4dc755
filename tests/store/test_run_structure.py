"""Protects the file of a run: groups, scales, its config, its seal, and nothing beside it."""

import dataclasses

import h5py
import numpy as np
import pytest
from support.results import assert_equal, result

from rbstab.store.errors import NotAResultError
from rbstab.store.result import Result
from rbstab.store.run_file import open_result, write_result
from rbstab.store.variables import Variable

TRACKED = h5py.h5p.CRT_ORDER_TRACKED | h5py.h5p.CRT_ORDER_INDEXED


def with_variables(**variables):
    original = result()
    return dataclasses.replace(original, variables=original.variables | variables)


@pytest.fixture
def grouped():
    """A result with two groups; each has a coordinate of its own."""
    variables: dict[str, Variable] = {}
    for group, length in (("first", 2), ("second", 4)):
        numbers = np.arange(1.0, length + 1)
        variables |= {
            f"{group}/check": Variable(("check",), numbers, "1", "number of a check"),
            f"{group}/margin": Variable(("check",), -numbers, "J", "margin"),
        }
    return with_variables(**variables)


def test_groups_come_back(tmp_path, grouped):
    write_result(tmp_path / "a.h5", grouped)
    assert_equal(open_result(tmp_path / "a.h5"), grouped)


def test_order_is_tracked_in_the_file_and_its_groups(tmp_path, grouped):
    """netCDF-4 requires it."""
    write_result(tmp_path / "a.h5", grouped)
    with h5py.File(tmp_path / "a.h5") as file:
        groups = [h5py.h5g.open(file.id, name) for name in (b"/", b"first", b"second")]
        orders = [group.get_create_plist().get_link_creation_order() for group in groups]
        assert orders == [TRACKED] * 3
        arrays = [file[name] for name in ("time", "config", "first/check", "second/margin")]
        orders = [array.id.get_create_plist().get_attr_creation_order() for array in arrays]
        assert orders == [TRACKED] * 4


def test_every_scale_has_its_name(tmp_path, grouped):
    write_result(tmp_path / "a.h5", grouped)
    with h5py.File(tmp_path / "a.h5") as file:
        for name in ("time", "axis", "part", "first/check", "second/check"):
            scale = file[name]
            assert scale.is_scale
            assert h5py.h5ds.get_scale_name(scale.id) == name.rpartition("/")[2].encode()


def test_a_coordinate_that_no_other_array_uses_comes_back(tmp_path):
    time = Variable(("time",), np.linspace(0, 1, 4), "s", "time")
    alone = Result({"time": time}, dict(result().attributes), "")
    write_result(tmp_path / "a.h5", alone)
    assert_equal(open_result(tmp_path / "a.h5"), alone)


def test_any_damage_of_a_sealed_file_is_noticed(tmp_path):
    """The seal covers the bytes that no array uses."""
    path = tmp_path / "a.h5"
    write_result(path, result())
    content = path.read_bytes()
    for at in range(0, len(content), len(content) // 60):
        path.write_bytes(content[:at] + bytes([content[at] ^ 4]) + content[at + 1 :])
        with pytest.raises(NotAResultError):
            open_result(path)


def test_nothing_is_written_beside_the_file(tmp_path, monkeypatch):
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    write_result(tmp_path / "there" / "a.h5", result())
    assert list(here.iterdir()) == []
    assert [path.name for path in (tmp_path / "there").iterdir()] == ["a.h5"]


@pytest.mark.parametrize("kind", ["list of one text", "list of two texts", "number"])
def test_a_config_that_is_not_one_text(tmp_path, kind):
    path, text = tmp_path / "a.h5", h5py.string_dtype("utf-8")
    write_result(path, result())
    with h5py.File(path, "r+") as file:
        config = file["config"].asstr()[()]
        del file["config"]
        if kind == "number":
            made = file.create_dataset("config", data=1.0)
        else:
            data = [config] * (1 if kind == "list of one text" else 2)
            made = file.create_dataset("config", data=data, dtype=text)
            made.dims[0].attach_scale(file["time"])
        made.attrs["long_name"] = "resolved config, YAML"
    with pytest.raises(NotAResultError) as caught:
        open_result(path)
    assert str(caught.value) == f"{path} is damaged: its config is not a text"
