"""Protects the quantities of a result: each has its dimensions and the right values."""

import numpy as np
import pytest
from support.paper_runs import paper_config, paper_run
from support.systems import VARIANTS

import rbstab
from rbstab.systems.quantities import BY_NAME

ALWAYS = {
    "time",
    "orientation",
    "angular_velocity",
    "position",
    "velocity",
    "contact_displacement",
    "contact_velocity",
    "contact_force",
    "stabilizing_force",
    "stabilizing_couple",
    "lyapunov",
    "lyapunov_rate",
    "lyapunov_change",
    "energy",
    "dissipation",
    "energy_residual",
    "contact_work",
    "energy_at_rest",
    "energy_round_off",
    "rest_orientation",
    "rest_position",
    "peak_contact_displacement",
    "peak_contact_displacement_error",
    "peak_distance",
    "peak_distance_error",
    "largest_pitch",
    "largest_pitch_error",
    "settling_time",
    "settling_time_error",
}
ONLY_EMBEDDED = {"connector_state"}
ONLY_MANIFOLD = {"constraint_position_residual", "constraint_velocity_residual"}
COORDINATES = {"axis", "part"}

each_variant = pytest.mark.parametrize("variant", VARIANTS)


@pytest.fixture(scope="module")
def manifold_run():
    return rbstab.simulate(
        paper_config("permanent", with_gravity=True, coordinates="manifold", samples=41, rtol=1e-9)
    )


def ungrouped(result):
    return {name for name in result.variables if "/" not in name}


@each_variant
@pytest.mark.parametrize("engine", ["scipy", "heyoka"])
def test_result_holds_the_quantities_of_its_variant(variant, engine):
    expected = ALWAYS | COORDINATES | (ONLY_EMBEDDED if variant == "embedded" else set())
    assert ungrouped(paper_run(variant, True, engine)) == expected


def test_drift_of_the_contact_point_is_told_on_the_sub_manifold(manifold_run):
    assert ungrouped(manifold_run) == ALWAYS | COORDINATES | ONLY_MANIFOLD
    for level, source in (("position", "displacement"), ("velocity", "velocity")):
        drift = manifold_run[f"constraint_{level}_residual"]
        assert manifold_run.variables[f"constraint_{level}_residual"].dimensions == ("time",)
        size = np.sqrt((manifold_run[f"contact_{source}"] ** 2).sum(axis=1))
        np.testing.assert_allclose(drift, size, rtol=1e-12)
        assert 0 < drift.max() < 1e-6


@each_variant
def test_arrays_have_the_shapes_of_their_dimensions(variant):
    result = paper_run(variant, True, "scipy")
    parts = 5 if variant in {"visco-elastic", "embedded"} else 4
    sizes = {"time": 401, "axis": 3, "part": parts, "check": 7}
    for name, variable in result.variables.items():
        assert variable.data.shape == tuple(sizes[d] for d in variable.dimensions), name
        if name in BY_NAME:
            quantity = BY_NAME[name]
            assert variable.dimensions == quantity.dimensions
            assert variable.unit == quantity.unit
            assert variable.long_name == f"{quantity.symbol}: {quantity.meaning}"
            assert variable.data.dtype == np.float64
            assert np.isfinite(variable.data).all()
    np.testing.assert_array_equal(result["axis"], [1, 2, 3])
    names = ["kinetic", "gravity", "translational stabilizer", "rotational stabilizer", "connector"]
    assert result["part"].tolist() == names[:parts]
    np.testing.assert_array_equal(result["time"], np.linspace(0.0, 2.0, 401))


@pytest.mark.parametrize("coordinates", ["Z", "W"])
def test_first_row_is_the_initial_state_of_the_config(coordinates):
    initial = {
        "orientation": [0.1, -0.2, 0.3],
        "angular_velocity": [1.0, -2.0, 3.0],
        "position": [0.01, 0.02, -0.03],
        "velocity": [0.4, -0.5, 0.6],
        "connector_state": [0.07, -0.08, 0.09],
    }
    short = {"duration": 0.01, "samples": 2, "coordinates": coordinates}
    result = rbstab.simulate(paper_config("embedded", True, initial=initial, **short))
    for name, value in initial.items():
        np.testing.assert_allclose(result[name][0], value, rtol=0, atol=1e-15, err_msg=name)
