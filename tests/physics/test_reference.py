"""Every variant agrees with trajectories of another program in extended precision."""

import numpy as np
import pytest
from support.paper_runs import CASE_NAMES, CASES, paper_run, reference_case
from support.problems import ENGINES

STATES = {
    "Theta": "orientation",
    "Omega": "angular_velocity",
    "X": "position",
    "V": "velocity",
    "E": "contact_displacement",
    "F": "contact_velocity",
    "D": "connector_state",
}

# A thousand times the tolerance of a step, 1e-12, in rad, m and s.
STATE_ERROR = 1e-9
FORCE_ERROR = 1e-9  # of the largest force on the trace


def each_case(function):
    return pytest.mark.parametrize(("variant", "with_gravity"), CASES, ids=CASE_NAMES)(function)


@pytest.mark.parametrize("engine", ENGINES)
@each_case
def test_states_and_contact_force_follow_the_reference(variant, with_gravity, engine):
    result = paper_run(variant, with_gravity, engine)
    samples = reference_case(variant, with_gravity)["states"]
    times = np.array([sample["t"] for sample in samples])
    rows = np.rint(times / 2.0 * 400).astype(int)
    np.testing.assert_allclose(result["time"][rows], times, rtol=0, atol=1e-15)
    for symbol, name in STATES.items():
        assert (symbol in samples[0]) == (name in result)
        if name in result:
            expected = np.array([sample[symbol] for sample in samples])
            np.testing.assert_allclose(
                result[name][rows], expected, rtol=0, atol=STATE_ERROR, err_msg=name
            )
    force = np.array([sample["Lam"] for sample in samples])
    np.testing.assert_allclose(
        result["contact_force"][rows], force, rtol=0, atol=FORCE_ERROR * np.abs(force).max()
    )


@each_case
def test_engines_agree_over_the_whole_trace(variant, with_gravity):
    by_scipy, by_heyoka = (paper_run(variant, with_gravity, engine) for engine in ENGINES)
    assert len(by_scipy["time"]) == 401
    np.testing.assert_array_equal(by_scipy["time"], by_heyoka["time"])
    for name in STATES.values():
        if name in by_scipy:
            np.testing.assert_allclose(
                by_heyoka[name], by_scipy[name], rtol=0, atol=STATE_ERROR, err_msg=name
            )
    scale = np.abs(by_scipy["contact_force"]).max()
    np.testing.assert_allclose(
        by_heyoka["contact_force"], by_scipy["contact_force"], rtol=0, atol=FORCE_ERROR * scale
    )
