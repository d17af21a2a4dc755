"""Protects the proofs of configs with elements: what is proved with them, and what never is."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import root
from support.config_elements import (
    CONTROLLER,
    ONE_OF_EACH,
    RANGE,
    STRUT,
    TIE,
    UPRIGHT,
    config_data,
)
from support.pose import attitude
from support.robust import robust_levels

import rbstab
from rbstab.config.load import load_config
from rbstab.config.tolerances import tolerances_of
from rbstab.experiment.answers.reasons import NOT_DAMPED
from rbstab.experiment.proof import prove
from rbstab.experiment.robust.bodies import prove_within
from rbstab.experiment.robust.cache import bodies_for
from rbstab.experiment.stored_proof.identity import proof_id

RANGE_END = np.array([np.pi, np.pi / 2, np.pi])

WEAK = CONTROLLER | {"K_r": [4.0, 4.0, 3.2]}
"""So weak that other rest states appear."""

FAR_TIE = TIE | {"point": [0.1, 0.2, -0.3], "anchor": [0.3, 0.1, -0.5]}

EMBEDDED_TIE = FAR_TIE | {
    "kind": "embedded",
    "K_d": [700.0, 500.0, 900.0],
    "L_d": [20.0, 20.0, 30.0],
    "initial_state": [0.1, 0.0, 0.0],
}

CASES: dict[str, Any] = {
    "tie": config_data({"tie": TIE}),
    "attitude": config_data({"upright": UPRIGHT}),
    "both": config_data({"tie": TIE, "upright": UPRIGHT}),
    "two ties": config_data({"tie": FAR_TIE, "second": TIE | {"point": [0.3, 0.0, 0.1]}}),
    "embedded tie": config_data({"one": EMBEDDED_TIE}),
    "embedded ties": config_data({"one": EMBEDDED_TIE, "tie": FAR_TIE, "upright": UPRIGHT}, WEAK),
    "weak": config_data({"tie": FAR_TIE, "upright": UPRIGHT}, WEAK),
}


def matrix(entries):
    """Return a gain of a config as a matrix."""
    values = np.asarray(entries)
    return np.diag(values) if values.ndim == 1 else values


def stiffness(tie):
    """Return the stiffness of a tie at rest; an embedded one is two springs in series."""
    K_c = matrix(tie["K_c"])
    if tie["kind"] == "visco-elastic":
        return K_c
    return np.linalg.inv(np.linalg.inv(K_c) + np.linalg.inv(matrix(tie["K_d"])))


def parts_of(data):
    """Return K_t, K_r, K of all attitude springs, the load, and all ties as (K_c, p, anchor)."""
    gains, elements = data["controller"], data["elements"].values()
    ties = [
        (stiffness(one), np.array(one["point"]), np.array(one["anchor"]))
        for one in elements
        if one["kind"] in {"visco-elastic", "embedded"}
    ]
    uprights = [matrix(one["K"]) for one in elements if one["kind"] == "attitude"]
    upright = sum(uprights, np.zeros((3, 3)))
    load = data["body"]["mass"] * np.array(data["gravity"])
    return matrix(gains["K_t"]), matrix(gains["K_r"]), upright, load, ties


def energy_of(data):
    """Return the stored energy of a config as a function of Θ, X; X is at rest by default."""
    K_t, K_r, upright, load, ties = parts_of(data)
    compliance = np.linalg.inv(sum((K for K, _, _ in ties), K_t))

    def energy(Theta, X=None):
        A = attitude(Theta)
        if X is None:
            X = compliance @ (load - sum(K @ (A @ p - anchor) for K, p, anchor in ties))
        pull = [(K, X + A @ p - anchor) for K, p, anchor in ties]
        held = X @ K_t @ X - 2 * load @ X + Theta @ K_r @ Theta + np.sum(upright * (np.eye(3) - A))
        return float(held + sum(e @ K @ e for K, e in pull)) / 2

    return energy


def slope_of(function):
    """Return the gradient by central differences."""

    def slope(q):
        steps = 1e-5 * np.eye(len(q))
        return np.array([(function(q + h) - function(q - h)) / 2e-5 for h in steps])

    return slope


def rest_states_by_search(data, starts):
    """Return Θ of the rest states inside the range that scipy finds from random starts."""
    rng = np.random.default_rng(0)
    slope = slope_of(energy_of(data))
    found: list[np.ndarray] = []
    for _ in range(starts):
        solution = root(slope, rng.uniform(-1, 1, size=3) * RANGE_END, method="hybr", tol=1e-10)
        Theta = solution.x
        inside = np.all(np.abs(Theta) < RANGE_END)
        if np.abs(slope(Theta)).max() > 1e-4 or not inside:
            continue
        if all(np.abs(Theta - other).max() > 1e-4 for other in found):
            found.append(Theta)
    return sorted(map(tuple, found))


@pytest.mark.parametrize("name", CASES)
def test_proved_rest_states_are_those_of_a_search_from_fifty_starts(name):
    data = CASES[name]
    proof = prove(load_config(data))
    assert proof.proved
    found = rest_states_by_search(data, 50)
    proved = sorted(state.orientation for state in proof.states)
    assert len(found) == len(proved)
    np.testing.assert_allclose(found, proved, atol=1e-5)
    energy = energy_of(data)
    for state in proof.states:
        Theta, X = np.array(state.orientation), np.array(state.position)
        assert energy(Theta, X) == pytest.approx(state.energy, rel=1e-9)
        np.testing.assert_allclose(slope_of(lambda x, at=Theta: energy(at, x))(X), 0, atol=1e-4)


def test_the_cases_are_not_all_of_one_rest_state():
    assert len(prove(load_config(CASES["weak"])).states) > 1
    assert prove(load_config(CASES["both"])).unique is True


@pytest.mark.parametrize("variant", ["free", "permanent"])
@pytest.mark.parametrize("name", ["range", "strut and range"])
def test_an_outer_guard_is_taken_into_account(name, variant):
    elements = {one: ONE_OF_EACH[one] for one in name.split(" and ")} | {"tie": TIE}
    config = load_config(config_data(elements, CONTROLLER | {"variant": variant}))
    proof = prove(config)
    if (name, variant) == ("strut and range", "free"):
        # A spring may lose its length on the way.
        assert (proof.proved, proof.unique, proof.closed) == (True, True, None)
        assert proof.within_barriers
    else:
        assert proof.closed
        assert len(proof.states) == 1
    within = prove_within(config, tolerances_of(config, ["controller.K_r=±1%"]))
    if (name, variant) == ("strut and range", "free"):
        assert (within.proved, within.level) == (None, 0.0)
    else:
        assert within.proved
        # No motion of any energy reaches the end of the range.
        assert within.level > 1e9


POINT = TIE | {"point": [0.0, 0.0, 0.0], "anchor": [0.0, 0.0, 0.0]}

UNDAMPED: dict[str, Any] = {
    "nothing": {},
    "attitude": {"upright": UPRIGHT},
    "tie": {"tie": TIE},
    "two ties": {"tie": TIE, "other": POINT},
}


@pytest.mark.parametrize("gravity", [[0.0, 0.0, -9.81], [0.0, 0.0, 0.0]], ids=["heavy", "floating"])
@pytest.mark.parametrize("name", UNDAMPED)
def test_where_not_every_motion_is_damped_nothing_is_ever_proved(name, gravity):
    config = load_config(config_data(UNDAMPED[name], None, gravity=gravity))
    proof = prove(config)
    assert NOT_DAMPED in proof.outcome
    assert (proof.proved, proof.unique, proof.states, proof.region) == (False, None, (), None)
    within = prove_within(config, tolerances_of(config, ["body.mass=±1%"]))
    assert NOT_DAMPED in within.why
    assert (within.proved, within.level) == (None, 0.0)


DAMPING_TIES = {"tie": TIE, "at the centre": POINT, "embedded": EMBEDDED_TIE}


@pytest.mark.parametrize("name", DAMPING_TIES)
def test_an_attitude_spring_and_a_tie_damp_every_motion(name):
    """They take the place of the stabilizers; the rest state is where a motion ends."""
    data = config_data({"tie": DAMPING_TIES[name], "upright": UPRIGHT}, None)
    proof = prove(data)
    lowest = proof.states[0]
    assert (lowest.proved, lowest.index) == (True, 0)
    # After half a turn the spring is at rest too; some of these states are at ends of the range.
    assert proof.unique is not True
    assert proof.region is not None
    assert proof.region.lower_bound > 100
    result = rbstab.simulate(data | {"integration": {"duration": 120.0, "samples": 4}})
    assert result["orientation"][-1] == pytest.approx(lowest.orientation, abs=1e-4)


def test_proof_ids_differ_with_the_elements():
    """In each number, in the kinds, and in how many there are; but not with the order."""
    tie = {"tie": TIE}
    different = [
        config_data({}),
        config_data(tie),
        config_data({"tie": TIE | {"point": [0.0, 0.2, 1e-9]}}),
        config_data({"tie": TIE | {"anchor": [0.0, 0.25, 0.02]}}),
        config_data({"tie": TIE | {"K_c": [1000.0, 1200.0, 2000.0]}}),
        config_data({"tie": TIE, "other": TIE}),
        config_data({"tie": TIE, "upright": UPRIGHT}),
        config_data({"tie": TIE, "upright": UPRIGHT}, None),
        config_data({"tie": TIE, "strut": STRUT}),
        config_data({"tie": TIE, "strut": STRUT | {"rest_length": 0.81}}),
        config_data({"tie": TIE, "range": RANGE}),
    ]
    ids = [proof_id(load_config(data)) for data in different]
    assert len(set(ids)) == len(ids)
    turned = config_data({"upright": UPRIGHT, "tie": TIE})
    assert list(turned["elements"]) == ["upright", "tie"]
    assert proof_id(load_config(turned)) == ids[6]


def test_version_two_without_elements_has_the_proofs_of_version_one():
    first = {key: value for key, value in config_data({}).items() if key != "elements"}
    assert proof_id(load_config(first | {"schema_version": 1})) == proof_id(load_config(first))


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A folder of results with a proof for all masses near 41 kg of a config without elements."""
    path: Path = tmp_path_factory.mktemp("results")
    config = load_config(config_data({}))
    assert bodies_for(path, config, tolerances_of(config, ["body.mass=±1%"])).proved
    return path


@pytest.mark.parametrize("name", [*ONE_OF_EACH, "none"])
def test_a_stored_proof_without_elements_never_covers_elements(folder, name):
    mass = {("body", "mass"): np.array([41.0, 41.1])}
    assert (robust_levels(folder, load_config(config_data({})), mass, 2) > 0).all()
    elements = {} if name == "none" else {name: ONE_OF_EACH[name]}
    config = load_config(config_data(elements, None if name == "none" else CONTROLLER))
    assert not robust_levels(folder, config, mass, 2).any()
    assert not robust_levels(folder, config, {}, 2).any()


def test_a_stored_proof_with_elements_covers_these_alone(tmp_path):
    config = load_config(config_data({"tie": TIE}))
    texts = ["body.mass=±1%", "elements.tie.point[1]=±0.01"]
    record = bodies_for(tmp_path, config, tolerances_of(config, texts))
    assert record.proved
    assert record.level > 0
    place = {("elements", "tie", "point", 1): np.array([0.2, 0.205, 0.2101, 0.19])}
    levels = robust_levels(tmp_path, config, place, 4)
    assert levels.tolist() == [record.level, record.level, 0.0, record.level]
    others = [
        {},
        {"other": TIE},
        {"tie": TIE, "upright": UPRIGHT},
        {"tie": TIE | {"L_c": [30.0, 30.0, 12.1]}},
        {"tie": STRUT},
    ]
    for elements in others:
        other = load_config(config_data(elements))
        assert not robust_levels(tmp_path, other, {}, 1).any()
