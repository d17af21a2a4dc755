"""Protects the varied parameters as axes of figures, and their division into cells."""

import numpy as np
import pytest
from support.made_sweeps import SPIN

from rbstab.report.sweeps.parameters import MAX_CELLS, binned


def test_a_list_has_a_cell_for_each_entry_in_ascending_order(members):
    swept = members({"body.mass": {"values": [3, 1, 2, 1]}})
    (mass,) = swept.parameters
    made = binned(mass)
    assert mass.axis.text == "mass [kg]"
    assert made.middles.tolist() == [1.0, 2.0, 3.0]
    assert made.indices.tolist() == [2, 0, 1, 0]
    assert not made.axis.log


@pytest.mark.parametrize(
    "values", [{"geomspace": [0.01, 100, 5]}, {"logspace": [-2, 2, 5]}], ids=["geom", "log"]
)
def test_equal_ratios_are_drawn_so(members, values):
    (factor,) = members({"controller.K_r": {"scale": values}}).parameters
    made = binned(factor)
    assert made.axis.log
    assert made.axis.text == "K_r[0] (with all of K_r) [N m/rad]"
    assert made.middles == pytest.approx([4, 40, 400, 4000, 40_000])


def test_entries_of_a_long_list_are_taken_together(members):
    count = 2 * MAX_CELLS - 3
    (mass,) = members({"body.mass": {"linspace": [1, count, count]}}).parameters
    made = binned(mass)
    assert len(made.middles) == MAX_CELLS - 1
    assert set(np.bincount(made.indices).tolist()) == {1, 2}
    # Each entry is beside the middle of its cell: a cell is at most two entries wide.
    assert np.abs(made.middles[made.indices] - mass.values).max() <= 1.0


@pytest.mark.parametrize(("word", "middles"), [("uniform", [2, 4]), ("loguniform", [1.4, 4.4])])
def test_drawn_values_have_cells_that_are_equally_wide(members, word, middles):
    design = {"design": "sobol", "members": 256, "seed": 2}
    (mass,) = members({"body.mass": {word: [0.8, 8.0]}}, **design).parameters
    made = binned(mass, 2)
    low, high = mass.values.min(), mass.values.max()
    edge = (low + high) / 2 if word == "uniform" else np.sqrt(low * high)
    assert made.sampled
    assert made.indices.tolist() == (mass.values >= edge).astype(int).tolist()
    if word == "uniform":
        assert made.middles == pytest.approx([(low + edge) / 2, (edge + high) / 2])
    else:
        assert made.middles == pytest.approx([np.sqrt(low * edge), np.sqrt(edge * high)])


def test_what_has_one_value_is_no_parameter(members):
    vary = {"body.mass": {"values": [2]}, f"{SPIN}[0]": {"values": [3, 3]}}
    assert members(vary).parameters == ()


def test_of_several_keys_together_the_one_with_most_values_is_drawn(members):
    group = {"body.mass": {"values": [1, 1, 2]}, f"{SPIN}[1]": {"values": [5, 7, 6]}}
    (both,) = members({"group": {"zip": group}}).parameters
    assert both.name == "group"
    assert both.axis.text == "initial angular_velocity[1] (with mass) [rad/s]"
    assert both.values.tolist() == [5, 7, 6]


def test_variants_are_words(members):
    (variant,) = members({"controller.variant": {"values": ["visco-elastic", "free"]}}).parameters
    assert variant.axis.categories == ("visco-elastic", "free")
    assert variant.values.tolist() == [0, 1]
