"""The picture on the card of a sweep: the share of members at rest rises with time."""

import numpy as np
import pytest
from support.made_sweeps import GRID, SPIN

from rbstab.report.sweeps.conditions.paired_conditions import paired_conditions_of
from rbstab.report.sweeps.sketches import MAX_CURVES, rest_sketch

EACH = {
    "controller.variant": {"each": {"values": ["visco-elastic", "free"]}},
    f"{SPIN}[0]": {"normal": [0, 6]},
}


def sketch_of(members):
    """Return the sketch of a sweep that has one."""
    sketch = rest_sketch(members, paired_conditions_of(members))
    assert sketch is not None
    return sketch


def test_the_share_rises_by_one_member_at_a_time(members):
    """Of 20 members, number k is at rest from 0.1 (k + 1) s on, but the last five never are."""

    def columns(a):
        time = 0.1 * (a["run"] + 1.0)
        return {"settling_time": np.where(a["run"] < 15, time, np.nan)}

    sketch = sketch_of(members(GRID, columns))
    ((label, points),) = sketch.curves
    assert label == ""
    times = 1.5 * points[:, 0]
    # Half a step away from the jumps, so that round-off does not matter.
    middle = np.abs(10 * times - np.round(10 * times)) > 0.01
    expected = np.floor(10 * times) / 20
    assert points[middle, 1] == pytest.approx(expected[middle])
    assert points[-1] == pytest.approx([1.0, 15 / 20])
    assert sketch.words == (
        "Share of the members that are at rest, over time. From 0 to 1, over 0 s to 1.5 s."
    )


def test_each_condition_has_a_curve(members):
    def columns(a):
        return {"settling_time": 1.0 + a["controller_variant"]}

    found = members(EACH, columns, design="random", members=50, seed=4)
    sketch = sketch_of(found)
    (first, early), (second, late) = sketch.curves
    assert (first, second) == ("visco-elastic", "free")
    assert (early[120, 1], late[120, 1], late[-1, 1]) == (1.0, 0.0, 1.0)


def test_too_many_conditions_are_one_curve(members):
    each = {"body.mass": {"each": {"values": [float(m) for m in range(1, MAX_CURVES + 2)]}}}
    found = members(
        each | {f"{SPIN}[0]": {"normal": [0, 6]}},
        lambda a: {"settling_time": 1.0 + 0 * a["run"]},
        design="random",
        members=5,
        seed=4,
    )
    conditions = paired_conditions_of(found)
    assert conditions is not None
    assert len(conditions.labels) == MAX_CURVES + 1
    assert len(sketch_of(found).curves) == 1


def test_without_a_member_at_rest_there_is_no_picture(members):
    found = members(GRID, lambda a: {"settling_time": np.full(len(a["run"]), np.nan)})
    assert rest_sketch(found, None) is None
