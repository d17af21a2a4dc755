"""Protects the comparison of a proof's energy with the equations, evaluated in balls."""

import copy
from functools import partial

import numpy as np
import pytest
from rbstab.experiment.stored_proof.written_energies import energy_of
from support.paper_runs import CASE_NAMES, CASES, paper_config

import rbstab
from rbstab.analysis.proof.reduced_energy import reduced_energy
from rbstab.analysis.proof_check.equations import agrees_with_equations
from rbstab.config.build import system_of
from rbstab.config.load import plain_data

LONG = {
    "kind": "ligament",
    "point": [0.0, 0.1, 0.3],
    "anchor": [0.2, 0.0, 0.9],
    "stiffness": 300.0,
    "slack_length": 20.0,
    "toe_strain": 0.2,
}


@pytest.mark.parametrize(("variant", "with_gravity"), CASES, ids=CASE_NAMES)
def test_each_coefficient_is_seen(variant: str, with_gravity: bool) -> None:
    config = rbstab.load_config(paper_config(variant, with_gravity))
    exact = partial(system_of, config)
    form = reduced_energy(system_of(config), exact).form
    energy = {
        "quadratic": form.quadratic.tolist(),
        "linear": form.linear.tolist(),
        "coefficients": form.coefficients.tolist(),
    }
    assert agrees_with_equations(energy, exact)
    scale = np.abs(form.quadratic).max()
    for place in ("quadratic", "linear", "coefficients"):
        values = np.array(energy[place])
        # The largest entry, and the first one, which may be 0.
        for index in [np.unravel_index(np.abs(values).argmax(), values.shape), (0,) * values.ndim]:
            other = values.copy()
            other[index] += 1e-9 * scale
            if place == "quadratic":
                other = (other + other.T) / 2
            changed = {**energy, place: other.tolist()}
            assert not agrees_with_equations(changed, exact)


@pytest.mark.parametrize("variant", ["permanent", "visco-elastic"])
def test_the_law_of_a_ligament_is_seen_that_is_slack_at_all_points(variant: str) -> None:
    """Its energy is zero wherever U is compared; the body can reach other places."""
    plain = rbstab.load_config(paper_config(variant, True))
    data = plain_data(plain) | {"schema_version": 2, "elements": {"band": LONG}}
    exact = partial(system_of, rbstab.load_config(data))
    energy = energy_of(reduced_energy(exact(), exact).form).model_dump(mode="json")
    assert agrees_with_equations(energy, exact)
    for name in ("stiffness", "slack_length", "toe_strain"):
        changed = copy.deepcopy(energy)
        free = changed.get("free_ligaments")
        (band,) = changed["ligaments"] if free is None else free["ligaments"]
        band[name] *= 1 + 1e-9
        assert not agrees_with_equations(changed, exact)


GUARDS = {
    "a": {"kind": "guard", "method": "stiff", "stiffness": 30.0, "soft_angle": 0.9},
    "b": {"kind": "guard", "method": "repelling", "couple": 4.0, "soft_angle": 1.1},
    "c": {"kind": "guard", "method": "stop", "angle": 1.3, "restitution": 0.5},
    "d": {"kind": "guard", "method": "barrier", "stiffness": 2.0, "outer_stiffness": 3.0},
}


@pytest.mark.parametrize(
    "change",
    [
        {"soft_guards": [(0, "stiffness", 30.0)]},
        {"soft_guards": [(0, "soft_angle", 0.9)]},
        {"soft_guards": [(1, "couple", 4.0)]},
        {"soft_guards": [(1, "soft_angle", 1.1)]},
        {"stop": 1.3},
        {"stop": None},
        {"barrier": 2.0},
        {"outer_barrier": 3.0},
    ],
)
def test_each_number_of_a_guard_is_seen(change) -> None:
    """Also of guards that act at none of the angles at which energies are compared."""
    data = plain_data(rbstab.load_config(paper_config("permanent", True)))
    data |= {"schema_version": 2, "elements": GUARDS}
    config = rbstab.load_config(data)
    exact = partial(system_of, config)
    energy = energy_of(reduced_energy(system_of(config), exact).form).model_dump(mode="json")
    assert agrees_with_equations(energy, exact)
    other = copy.deepcopy(energy)
    for key, value in change.items():
        if key == "soft_guards":
            for place, name, number in value:
                assert energy[key][place][name] == number
                other[key][place][name] = number * (1 + 1e-9)
        elif value is None:
            del other[key]
        else:
            assert energy[key] == value
            other[key] = value * (1 + 1e-9)
    assert not agrees_with_equations(other, exact)


@pytest.mark.parametrize("angle", [0.05, 1.0, 1.29, 1.31, 1.5])
def test_a_guard_that_the_config_does_not_have_is_seen(angle: float) -> None:
    """Wherever it begins, also near the end of the range, or beyond the stop."""
    data = plain_data(rbstab.load_config(paper_config("permanent", True)))
    for elements in ({}, GUARDS):
        config = rbstab.load_config(data | {"schema_version": 2, "elements": elements})
        exact = partial(system_of, config)
        energy = energy_of(reduced_energy(system_of(config), exact).form).model_dump(mode="json")
        more = {"couple": 1.0, "stiffness": 0.0, "soft_angle": angle}
        energy["soft_guards"] = [*energy.get("soft_guards", []), more]
        assert not agrees_with_equations(energy, exact)
