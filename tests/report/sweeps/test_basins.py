"""Protects the table and the map of the rest states that members approach."""

import numpy as np
import pytest
from support.made_sweeps import GRID, code

from rbstab.report.model.document import Table
from rbstab.report.model.figure import Cells
from rbstab.report.sweeps.basins import basin_blocks, basins_of
from rbstab.report.sweeps.maps.maps import over_parameters

STATES = np.array([[0.5, 0.0, 0.1], [-2.7, 0.3, -1.2]])


def two_basins(columns):
    """The first ten members approach the first state, the others a lower one."""
    second = columns["run"] >= 10
    status = np.where(columns["run"] == 19, code("step limit"), 0)
    noise = 1e-9 * columns["run"][:, np.newaxis]
    return {
        "rest_orientation": STATES[second.astype(int)] + noise,
        "energy_at_rest": np.where(second, -140.0, -120.0),
        "status": status,
        "settling_time": np.where(columns["run"] == 3, np.nan, 1.0),
    }


@pytest.fixture
def two(members):
    return members(GRID, two_basins)


def test_the_states_are_listed_lowest_first(two):
    basins = basins_of(two)
    assert basins is not None
    np.testing.assert_allclose(basins.orientations, STATES[::-1], atol=1e-7)
    assert basins.codes.tolist() == [1] * 10 + [0] * 9 + [-1]
    (table,) = basin_blocks("a", two)
    assert isinstance(table, Table)
    cells = [[cell.text for cell in row] for row in table.rows]
    assert cells == [
        ["1", "9", "-140", "(-2.7, 0.3, -1.2)"],
        ["2", "10", "-120", "(0.5, 0, 0.1)"],
    ]


def test_the_map_is_coloured_by_the_state(two):
    panels = {p.title: p for figure in over_parameters("a", two)[0] for p in figure.panels}
    (cells,) = (mark for mark in panels["approaches"].marks if isinstance(mark, Cells))
    assert cells.scale.categories == ("rest state 1", "rest state 2")
    # The second parameter, along the rows, varies fastest; the last member did not complete.
    by_member = cells.values.T.ravel() if cells.values.shape == (4, 5) else cells.values.ravel()
    np.testing.assert_array_equal(by_member, [1.0] * 10 + [0.0] * 9 + [np.nan])


def test_one_state_needs_no_map(members):
    swept = members(GRID, lambda columns: {"rest_orientation": np.zeros((len(columns["run"]), 3))})
    assert basins_of(swept) is None
    assert basin_blocks("a", swept) == []


@pytest.mark.parametrize("key", ["body.mass", "gravity[2]", "controller.K_r[0]"])
def test_rest_states_of_different_bodies_are_not_grouped(members, key):
    """Each body, gravity or gain has rest states of its own, though they look alike."""
    vary = {key: {"linspace": [40, 50, 20]}}
    different = members(vary, two_basins)
    assert basins_of(different) is None
    assert basin_blocks("a", different) == []


@pytest.mark.parametrize(("coordinates", "count"), [("quaternion", None), ("Z", 2)])
def test_turns_are_another_rest_state_only_where_something_reads_angles(
    members, monkeypatch, coordinates, count
):
    turned = members(
        GRID,
        lambda columns: (
            two_basins(columns)
            | {"rest_orientation": np.outer(columns["run"] >= 10, [2 * np.pi, 0, 0])}
        ),
    )
    monkeypatch.setattr(type(turned.plan), "in_quaternions", coordinates == "quaternion")
    basins = basins_of(turned)
    assert (basins if basins is None else len(basins.energies)) == count
