"""Protects the curve of the certified region on maps: where it is, and what it claims there."""

from types import SimpleNamespace

import numpy as np
from support.made_sweeps import GRID

from rbstab.report.model.figure import Figure, Line
from rbstab.report.sweeps.conditions.paired_conditions import Slice
from rbstab.report.sweeps.maps.figures import LEVEL, MEDIAN_LEVEL, Mapped, map_figures
from rbstab.report.sweeps.parameters import binned
from rbstab.sweep.proofs.convergence import EnergyBound

ACROSS, UP = "initial angular_velocity[0]", "initial angular_velocity[1]"


def curves_of(found):
    """Return the curves on each map, by its title; v(0) is 10 J a column, and c* is 25 J."""
    # The energies at rest of made up members are 1 J.
    bounds = {"visco-elastic": EnergyBound(26.0, 0.0)}
    no_boxes = np.zeros(len(found))
    found.__dict__["_certified"] = SimpleNamespace(
        bounds=bounds, boxes=lambda *_members: (no_boxes, no_boxes)
    )
    axes = {p.axis.label: binned(p) for p in found.parameters}
    what = Mapped("s", found, [Slice("all", None)])
    blocks = map_figures(what, (axes[ACROSS], axes[UP]), "")
    (figure,) = [block for block in blocks if isinstance(block, Figure)]
    return {p.title: [m for m in p.marks if isinstance(m, Line)] for p in figure.panels}


def columns(arrays):
    across = arrays["initial_angular_velocity_0"] + 2
    return {
        "lyapunov_start": 10.0 * across,
        "settling_time": 1.0 + across,
        "convergence": np.where(across < 2.5, 2, 1),
    }


def test_of_single_members_the_curve_bounds_what_is_proved(members):
    curves = curves_of(members(GRID, columns))
    for title in ("settling time of v [s]", "v(0) / c*"):
        (curve,) = curves[title]
        assert curve.label == LEVEL
        # v(0) = 10 (x + 2) J is 25 J at x = 0.5 rad/s, in every row.
        assert np.allclose(curve.x, 0.5)
        assert np.ptp(curve.y) == 30


def test_the_map_of_proofs_shows_the_border_by_its_cells(members):
    # A colour of its cells is that of the curve, which would be seen on one side only.
    assert curves_of(members(GRID, columns))["convergence of the exact motion"] == []


def test_of_several_members_the_curve_claims_half(members):
    """Of two members in each cell the second has 2 J more: the median is 1 J above the first."""

    def pairs(arrays):
        heavier = arrays["body_mass"] > 40.5
        found = columns(arrays)
        return found | {"lyapunov_start": found["lyapunov_start"] + 2.0 * heavier}

    found = members(GRID | {"body.mass": {"values": [40, 41]}}, pairs)
    (curve,) = curves_of(found)["settling time of v [s]"]
    assert curve.label == MEDIAN_LEVEL
    assert "half" in curve.label
    assert np.allclose(curve.x, 0.4)
