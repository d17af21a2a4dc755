"""Protects the quantities of a result: each has its dimensions and the right values."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.paper_runs import paper_config, paper_matrix, paper_run, reference_case
from support.systems import VARIANTS

import rbstab
from rbstab.systems.quantities import QUANTITIES

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


def test_every_quantity_of_the_table_is_expected_somewhere():
    sometimes = ONLY_EMBEDDED | ONLY_MANIFOLD | ONLY_SLIDING | ONLY_WITH_ELEMENTS | ONLY_WITH_STOP
    sometimes |= ONLY_WITH_INPUTS
    assert {q.name for q in QUANTITIES} == ALWAYS | sometimes


ONLY_WITH_ELEMENTS = {"element_force", "element_couple"}

ONLY_WITH_STOP = {
    "impact_count",
    "impact_loss",
    "stop_contact",
    "stop_angle",
    "impact_time",
    "impact_rate",
    "rest_begin",
    "rest_end",
}
ONLY_WITH_INPUTS = {"supplied_power", "supplied_energy"}

ONLY_SLIDING = {
    "mode",
    "switch_count",
    "chatter_energy",
    "discarded_energy",
    "trusted_until",
    "switch_time",
    "switch_axis",
    "transition_time",
    "transition_axis",
    "transition_kind",
}


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
    by_name = {quantity.name: quantity for quantity in QUANTITIES}
    for name, variable in result.variables.items():
        assert variable.data.shape == tuple(sizes[d] for d in variable.dimensions), name
        if name in by_name:
            quantity = by_name[name]
            assert variable.dimensions == quantity.dimensions
            assert variable.unit == quantity.unit
            assert variable.long_name == f"{quantity.symbol}: {quantity.meaning}"
            assert variable.data.dtype == np.float64
            assert np.isfinite(variable.data).all()
    np.testing.assert_array_equal(result["axis"], [1, 2, 3])
    names = ["kinetic", "gravity", "translational stabilizer", "rotational stabilizer", "connector"]
    assert result["part"].tolist() == names[:parts]
    np.testing.assert_array_equal(result["time"], np.linspace(0.0, 2.0, 401))


@each_variant
def test_dataset_has_the_same(variant):
    result = paper_run(variant, True, "scipy")
    dataset = result.to_xarray()
    assert set(dataset.variables) == ungrouped(result)
    assert set(dataset.coords) == {"time", "axis", "part"}
    assert dataset["velocity"].attrs["units"] == "m/s"
    assert dataset["energy"].sel(part="kinetic").values[0] == result["energy"][0, 0]


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


def rotations(result):
    """Return A at each sample by SciPy: rotations about the body axes 1, 2, 3."""
    return Rotation.from_euler("XYZ", result["orientation"]).as_matrix()


def rate_matrices(result):
    """Return B at each sample, from the axes of the three angles in body coordinates."""
    found = []
    for theta1, theta2, theta3 in result["orientation"]:
        first = Rotation.from_euler("XYZ", [theta1, theta2, theta3]).inv().apply([1, 0, 0])
        second = Rotation.from_euler("Z", theta3).inv().apply([0, 1, 0])
        found.append(np.linalg.inv(np.stack([first, second, [0, 0, 1]], axis=1)))
    return np.array(found)


def quadratic_form(matrix, x):
    return np.einsum("ti,ij,tj->t", x, matrix, x)


@each_variant
def test_contact_point_is_where_position_and_orientation_put_it(variant):
    result = paper_run(variant, True, "scipy")
    R = np.array(reference_case(variant, with_gravity=True)["params"]["R"])
    A = rotations(result)
    E = result["position"] + A @ R - R
    F = result["velocity"] + np.einsum("tij,tj->ti", A, np.cross(result["angular_velocity"], R))
    np.testing.assert_allclose(result["contact_displacement"], E, rtol=0, atol=1e-13)
    np.testing.assert_allclose(result["contact_velocity"], F, rtol=0, atol=1e-12)


@each_variant
def test_stabilizers_push_and_turn_by_their_gains(variant):
    result = paper_run(variant, True, "scipy")
    K_t, L_t, K_r, L_r = (paper_matrix(variant, name) for name in ("Kt", "Lt", "Kr", "Lr"))
    H = -result["position"] @ K_t - result["velocity"] @ L_t
    np.testing.assert_allclose(result["stabilizing_force"], H, rtol=0, atol=1e-9)
    spring = np.einsum("tji,tj->ti", rate_matrices(result), result["orientation"] @ K_r)
    N = -spring - result["angular_velocity"] @ L_r
    np.testing.assert_allclose(result["stabilizing_couple"], N, rtol=0, atol=1e-9)


@each_variant
def test_energy_and_dissipation_by_part(variant):
    result = paper_run(variant, True, "scipy")
    parameters = reference_case(variant, with_gravity=True)["params"]
    matrix = {name: paper_matrix(variant, name) for name in parameters if name[0] in "KL"}
    X, V = result["position"], result["velocity"]
    Theta, Omega = result["orientation"], result["angular_velocity"]
    E, F = result["contact_displacement"], result["contact_velocity"]
    zero = np.zeros(401)
    kinetic = 41.0 * (V**2).sum(axis=1) / 2 + quadratic_form(paper_matrix(variant, "J"), Omega) / 2
    energy = [
        kinetic,
        410.0 * X[:, 2],
        quadratic_form(matrix["Kt"], X) / 2,
        quadratic_form(matrix["Kr"], Theta) / 2,
    ]
    dissipation = [zero, zero, quadratic_form(matrix["Lt"], V), quadratic_form(matrix["Lr"], Omega)]
    if variant == "visco-elastic":
        energy.append(quadratic_form(matrix["Kc"], E) / 2)
        dissipation.append(quadratic_form(matrix["Lc"], F))
    if variant == "embedded":
        D = result["connector_state"]
        energy.append(quadratic_form(matrix["Kc"], E - D) / 2 + quadratic_form(matrix["Kd"], D) / 2)
        pull = (E - D) @ matrix["Kc"] - D @ matrix["Kd"]
        dissipation.append(
            quadratic_form(matrix["Lc"], F) + quadratic_form(np.linalg.inv(matrix["Ld"]), pull)
        )
    np.testing.assert_allclose(result["energy"], np.transpose(energy), rtol=1e-12, atol=1e-10)
    np.testing.assert_allclose(
        result["dissipation"], np.transpose(dissipation), rtol=1e-11, atol=1e-9
    )


@each_variant
def test_lyapunov_function_is_the_energy_above_rest(variant):
    result = paper_run(variant, True, "scipy")
    np.testing.assert_allclose(
        result["lyapunov"], result["energy"].sum(axis=1) - result["energy_at_rest"], rtol=1e-14
    )
    np.testing.assert_allclose(
        result["lyapunov_rate"], -result["dissipation"].sum(axis=1), rtol=1e-14
    )
    assert result["energy_at_rest"].shape == ()
    assert result["energy_at_rest"] < 0


@pytest.mark.parametrize("variant", ["visco-elastic", "embedded"])
def test_contact_force_is_the_connectors(variant):
    result = paper_run(variant, True, "scipy")
    own = result["connector_state"] if variant == "embedded" else np.zeros((401, 3))
    stretch = result["contact_displacement"] - own
    force = -stretch @ paper_matrix(variant, "Kc")
    force -= result["contact_velocity"] @ paper_matrix(variant, "Lc")
    np.testing.assert_allclose(result["contact_force"], force, rtol=0, atol=1e-8)
