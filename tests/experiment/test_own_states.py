"""Protects the own states of named elements: each has its place, its name, its start and its unit.

Two embedded ties beside an embedded controller have three states D, which must not be mixed up.
Facts that do not depend on the program: a tie at the contact point is the connector of the
controller, and at rest a tie is two springs in series.
"""

import numpy as np
import pytest
from support.config_elements import CONTROLLER, TIE, config_data
from support.pose import attitude

import rbstab
from rbstab.config.build import problem_of
from rbstab.config.load import acting_sections, load_config, run_id
from rbstab.config.numbers import entries_of
from rbstab.config.tolerances import tolerances_of
from rbstab.config.units import unit_of
from rbstab.experiment.convergence.enclosed_samples import quantities_of
from rbstab.experiment.start_sets.starts_record import starts_id
from rbstab.experiment.stored_proof.identity import proof_id

CONTACT = [0.15, 0.1, -0.42]
GAINS = {
    "K_c": [[4000.0, 300.0, 0.0], [300.0, 5000.0, -200.0], [0.0, -200.0, 6000.0]],
    "L_c": [150.0, 150.0, 200.0],
    "K_d": [900.0, 800.0, 1200.0],
    "L_d": [[120.0, 10.0, 0.0], [10.0, 150.0, 0.0], [0.0, 0.0, 90.0]],
}
D_START = [0.02, -0.03, 0.01]
STATES = ("connector_state", "left.state", "right.state")


def tie(point=CONTACT, factor=1.0, **changes):
    gains = {name: (factor * np.array(gain)).tolist() for name, gain in GAINS.items()}
    ends = {"point": point, "anchor": point}
    return {"kind": "embedded", **ends, **gains, "initial_state": D_START, **changes}


EMBEDDED = CONTROLLER | {"variant": "embedded"} | GAINS

THREE = {
    "left": tie([0.1, 0.2, 0.0], initial_state=[0.1, 0.0, 0.0]),
    "right": tie([0.1, -0.2, 0.0], 0.5, initial_state=[0.0, 0.2, 0.0]),
    "plain": TIE,
}
"""Beside the embedded controller, whose state comes first."""


def three(**changes):
    return config_data(THREE, EMBEDDED, initial={"connector_state": D_START}, **changes)


@pytest.mark.parametrize(
    ("coordinates", "engine"), [("Z", "scipy"), ("Z", "heyoka"), ("W", "scipy")]
)
def test_a_tie_at_the_contact_point_is_the_connector_of_the_controller(engine, coordinates):
    settings = {"engine": engine, "coordinates": coordinates}
    start = {"connector_state": D_START}
    both = config_data({}, EMBEDDED, initial=start), config_data({"tie": tie()})
    controller, named = (
        rbstab.simulate(description | {"integration": description["integration"] | settings})
        for description in both
    )
    # In W the tie computes its displacement anew. The other round-off changes the steps of SciPy,
    # and so its errors between them.
    bound = 1e-12 if coordinates == "Z" else 1e-10
    bodies = ("orientation", "angular_velocity", "position", "velocity", "energy", "lyapunov")
    pairs = {name: (named[name], controller[name]) for name in bodies}
    pairs["D"] = named["tie.state"], controller["connector_state"]
    for name, (actual, expected) in pairs.items():
        assert np.abs(actual - expected).max() < bound * max(1.0, np.abs(expected).max()), name
    force = controller["contact_force"]
    difference = np.abs(named["element_force"][:, 0] - force).max()
    assert difference < 10 * bound * np.abs(force).max()
    np.testing.assert_array_equal(named["tie.state"][0], D_START)


@pytest.fixture(scope="module")
def run():
    return rbstab.simulate(three())


def test_each_state_has_its_place_and_its_start():
    problem = problem_of(load_config(three()))
    places = problem.system.own_states
    assert places == {name: slice(12 + 3 * k, 15 + 3 * k) for k, name in enumerate(STATES)}
    starts = [problem.start[place].tolist() for place in places.values()]
    assert starts == [D_START, [0.1, 0.0, 0.0], [0.0, 0.2, 0.0]]
    assert problem.exact is not None
    exact, start = problem.exact(lambda values: values)
    np.testing.assert_array_equal(start, problem.start)
    assert exact.own_states == places
    assert quantities_of(problem.system)["right.state"] == slice(18, 21)


def test_the_stored_states_give_the_stored_energies(run):
    """½ (e - D)'K_c(e - D) + ½ D'K_d D with e of each point, in plain numpy."""
    parts = run["part"].tolist()
    for name, element in (("left", THREE["left"]), ("right", THREE["right"])):
        D, p = run[f"{name}.state"], np.array(element["point"])
        e = run["position"] + np.array([attitude(a) @ p for a in run["orientation"]]) - p
        K_c, K_d = np.array(element["K_c"]), np.diag(element["K_d"])
        stretch = np.einsum("ti,ij,tj->t", e - D, K_c, e - D)
        energy = (stretch + np.einsum("ti,ij,tj->t", D, K_d, D)) / 2
        np.testing.assert_allclose(run["energy"][:, parts.index(name)], energy, rtol=1e-12)
        variable = run.variables[f"{name}.state"]
        assert (variable.unit, variable.dimensions) == ("m", ("time", "axis"))
        assert variable.long_name.startswith("D: ")
    assert "plain.state" not in run
    v = run["lyapunov"]
    assert np.abs(run["energy_residual"]).max() < 1e-11 * v[0]
    assert (np.diff(v) < 0).all()


def test_a_start_belongs_to_the_initial_state_and_not_to_the_proof():
    config, other = load_config(three()), three()
    other["elements"]["left"]["initial_state"] = [0.0, 0.0, 0.3]
    other = load_config(other)
    assert run_id(config) != run_id(other)
    assert proof_id(config) == proof_id(other)
    assert "initial_state" not in acting_sections(config)["elements"]["left"]
    tolerances = tolerances_of(config, ["elements.left.initial_state=±0.001"])
    assert {tolerance.section for tolerance in tolerances} == {"initial"}
    assert starts_id(config, tolerances) != starts_id(other, tolerances)
    assert {
        tolerance.section for tolerance in tolerances_of(config, ["elements.left.K_d=±1%"])
    } == {"elements"}
    assert unit_of("elements.left.initial_state", [{"kind": "embedded"}]) == "m"
    keys = [entry.key for entry in entries_of(config)]
    assert keys.index("elements.left.initial_state[0]") > keys.index("initial.connector_state[2]")
