"""Members that Euler angles cannot follow finish in quaternions; all others are the same."""

from typing import Any

import numpy as np
import pytest

from rbstab.sweep.members.ensemble import EnsembleEngine
from rbstab.sweep.members.outcome import STATUSES
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.load import load_plan

BASE: dict[str, Any] = {
    "schema_version": 2,
    "body": {"mass": 1, "inertia": [0.01, 0.01, 0.01], "contact_point": [0, 0, 0]},
    "elements": {
        "tie": {
            "kind": "visco-elastic",
            "point": [0, 0, 0.1],
            "anchor": [0, 0, 0.1],
            "K_c": [100, 100, 100],
            "L_c": [5, 5, 5],
        },
        "upright": {"kind": "attitude", "K": [1, 1.2, 1.5], "L": [0.02, 0.02, 0.02]},
    },
    "initial": {"orientation": [0, 0.2, 0]},
}
# The third member turns about y alone, and so through the pole itself; the fourth and the last make
# several turns.
SPINS = np.array(
    [[3, 60, 2], [1, 5, 2], [0, 60, 0], [9, -2, 150], [0.1, 40, 0.01], [99, 1, 1]], dtype=float
)
COMPLETED, LEFT = STATUSES.index("completed"), STATUSES.index("range left")


def plan_of(coordinates, samples=41):
    integration = {"duration": 2, "samples": samples, "engine": "heyoka"}
    spins = {f"initial.angular_velocity[{k}]": {"values": SPINS[:, k].tolist()} for k in range(3)}
    base = BASE | {"integration": integration | {"coordinates": coordinates}}
    return load_plan({"base": base, "vary": {"spin": {"zip": spins}}})


def engine_of(plan):
    return EnsembleEngine(plan, SingleRuns(plan, "heyoka"))


def assert_same(found, expected, rows, error):
    for name, column in expected.items():
        if column.dtype.kind == "f" and not name.endswith("_error"):
            scale = max(1.0, np.nan_to_num(np.abs(column[rows])).max(initial=0.0))
            allowed = np.full(len(rows), error * scale)
            # Peaks have errors of their own.
            peak = "peak_orientation" if name == "smallest_regularity" else name
            if f"{peak}_error" in expected:
                allowed += found[f"{peak}_error"][rows] + expected[f"{peak}_error"][rows]
            a, b = (one[name][rows] for one in (found, expected))
            assert (np.isnan(a) == np.isnan(b)).all(), name
            differences = np.nan_to_num(np.abs(a - b)).reshape(len(rows), -1).max(axis=1)
            assert (differences <= allowed).all(), (name, differences, allowed)


@pytest.mark.parametrize("samples", [5, 41])
def test_members_that_leave_the_angles_finish_and_the_others_are_the_same(samples):
    found = engine_of(plan_of("quaternion", samples)).compute(0, 6).outcome
    in_angles = engine_of(plan_of("Z", samples)).compute(0, 6).outcome
    assert (found["status"] == COMPLETED).all()
    assert in_angles["status"][2] == LEFT
    same = np.flatnonzero(in_angles["status"] == COMPLETED)
    assert len(same) >= 4
    assert_same(found, in_angles, same, 1e-8)
    assert np.abs(found["final_orientation"][[3, 5]]).max(axis=1).min() > 3 * np.pi
    assert (found["peak_orientation_error"] < 1e-4).all()


def test_batches_are_single_runs_and_no_bit_depends_on_how_they_are_cut():
    plan = plan_of("quaternion")
    engine = engine_of(plan)
    whole = engine.compute(0, 6).outcome
    single = SingleRuns(plan, "heyoka").compute(0, 6).outcome
    assert_same(whole, single, [0, 1, 3, 4, 5], 1e-7)
    for start in range(6):
        part = engine.compute(start, start + 1).outcome
        for name, column in part.items():
            assert column.tobytes() == whole[name][start : start + 1].tobytes(), name
