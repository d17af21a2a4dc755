"""Every method against the reference at falling tolerances, and what that says of each other."""

import numpy as np
import pytest
from support.paper_runs import LOOSE_TOLERANCES, loose_run, reference_case

METHODS = [
    ("scipy", "DOP853"),
    ("scipy", "RK45"),
    ("scipy", "LSODA"),
    ("scipy", "Radau"),
    ("heyoka", ""),
]


def reference(symbol):
    states = reference_case("visco-elastic", weighed=True)["states"]
    (state,) = (state for state in states if state["t"] == 0.5)
    return np.array(state[symbol])


def errors(engine, method):
    """The largest error of an angle, a rate, a position or a velocity at t = 0.5 s."""
    found = []
    for rtol in LOOSE_TOLERANCES:
        result = loose_run(engine, rtol, method)
        assert result.status == "completed"
        assert result["time"][-1] == 0.5
        symbols = {
            "orientation": "Theta",
            "angular_velocity": "Omega",
            "position": "X",
            "velocity": "V",
        }
        found.append(
            max(np.abs(result[name][-1] - reference(symbols[name])).max() for name in symbols)
        )
    return np.array(found)


@pytest.mark.parametrize(("engine", "method"), METHODS)
def test_error_falls_with_the_tolerance(engine, method):
    found = errors(engine, method)
    # Each tolerance is a hundredth of the one before. A controller of local errors makes the error
    # at the end follow by about that; methods whose order varies follow it in jumps.
    assert (found[:-1] / found[1:] > 10).all(), found
    assert (found < 100 * np.array(LOOSE_TOLERANCES)).all(), found


def test_methods_differ_by_the_tolerance_and_no_more():
    ends = [loose_run(engine, 1e-8, method)["orientation"] for engine, method in METHODS]
    for end in ends[1:]:
        np.testing.assert_allclose(end, ends[0], rtol=0, atol=1e-7)
        # Equal to the last bit they would be one method under several names.
        assert not np.array_equal(end, ends[0])
