"""The error of every method falls with its tolerance, so all methods agree."""

import numpy as np
import pytest
from support.paper_runs import LOOSE_TOLERANCES, loose_run, reference_case
from support.problems import METHODS


def reference(symbol):
    states = reference_case("visco-elastic", with_gravity=True)["states"]
    (state,) = (state for state in states if state["t"] == 0.5)
    return np.array(state[symbol])


def errors(engine, method):
    """Return the largest error of the state at t = 0.5 s for each tolerance."""
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
    # Each tolerance is a hundredth of the one before. Local error control lets the final error
    # shrink by about that; with methods of varying order it shrinks in jumps.
    assert (found[:-1] / found[1:] > 10).all(), found
    assert (found < 100 * np.array(LOOSE_TOLERANCES)).all(), found


def test_methods_differ_by_the_tolerance_and_no_more():
    ends = [loose_run(engine, 1e-8, method)["orientation"] for engine, method in METHODS]
    for end in ends[1:]:
        np.testing.assert_allclose(end, ends[0], rtol=0, atol=1e-7)
        # If they were equal to the last bit, it would be one method under several names.
        assert not np.array_equal(end, ends[0])
