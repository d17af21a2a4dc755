"""Protects arrays with units on their way to xarray and pandas, on a table of three members."""

import numpy as np
import pytest

from rbstab.store.result import Result
from rbstab.store.variables import FlatColumns, Variable, dataset_of, flat_columns, joined


def words(*texts):
    return np.array(texts, dtype=object)


def three_members():
    return {
        "run": Variable(("run",), np.arange(3), "1", "number of the member"),
        "speed": Variable(("run",), np.array([5.0, 7.0, 9.0]), "rad/s", "varied key"),
        "status": Variable(("run",), words("late", "done", "late"), "1", "how it ended"),
    }


def test_no_array_of_a_result_or_a_dataset_can_be_changed():
    result = Result(three_members(), {}, "")
    dataset = dataset_of(three_members(), {}, ["speed"])
    for array in (result["speed"], dataset["speed"].values, dataset["status"].values):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def test_a_dataset_has_codes_with_their_words_and_selects_by_varied_values():
    dataset = dataset_of(three_members(), {"title": "three"}, ["speed"])
    assert dataset.attrs["title"] == "three"
    assert dataset["status"].values.tolist() == [1, 0, 1]
    assert dataset["status"].attrs["flag_meanings"] == "done late"
    assert "speed" in dataset.indexes
    assert dataset.sel(speed=7.0)["run"].item() == 1


def test_what_a_table_lacks_is_nan_or_an_empty_text():
    whole = flat_columns(three_members(), ("run",))
    bare = FlatColumns({"run": np.array([8])}, {"run": "1"})
    table = joined([whole, bare])
    assert table.arrays["run"].tolist() == [0, 1, 2, 8]
    assert table.arrays["status"].tolist() == ["late", "done", "late", ""]
    np.testing.assert_array_equal(table.arrays["speed"], [5.0, 7.0, 9.0, np.nan])
    assert table.units == {"run": "1", "speed": "rad/s", "status": "1"}
