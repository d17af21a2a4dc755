"""Protects V and V' as quadratic forms: they are the energy, the cross term and its derivative."""

from fractions import Fraction

import numpy as np
import pytest
from support.config_elements import BAND, HELD, STRUT, config_data, guard
from support.disturbed import (
    COUPLE,
    FORCE,
    forms_of_config,
    full_config,
    sprung_config,
    tied_config,
)

import rbstab
from rbstab.analysis.configuration import configurations
from rbstab.config.build import system_of
from rbstab.mechanics.attitude import rate_matrix
from rbstab.mechanics.derivatives import derivative_along
from rbstab.proof.disturbed.forms import NoFormsError, driven
from rbstab.proof.disturbed.matrices import Matrices

CONFIGS = {
    "held": tied_config("permanent"),
    "tied": tied_config("visco-elastic"),
    "embedded": tied_config("embedded"),
    "all": full_config(),
    "springs": sprung_config(),
}
CROSS, RATE = Fraction(7, 5), Fraction(9, 4)


def numbers_at(config, loads, rng):
    """Return V and V' + αV of a random state by the equations in doubles, and by the forms."""
    forms = forms_of_config(config, *loads)
    system = configurations(system_of(config)).system
    n, size = system.size, system.coordinates.size
    rest, held = forms.rest, system.coordinates.holds_contact
    y, w = rest + 0.3 * rng.normal(size=n), rng.normal(size=3 * len(loads))
    energy_at_rest = system.observe(rest).energy.sum()

    def V(y):
        motion = system.motion(y)
        p = np.linalg.solve(rate_matrix(motion.Theta), motion.Theta)
        J = system.body.inertia_about_contact if held else system.body.inertia
        cross = p @ J @ motion.Omega
        if not held:
            cross = cross + system.body.mass * (motion.X - rest[6:9]) @ motion.V
        return system.observe(y).energy.sum() - energy_at_rest + float(CROSS) * cross

    rate = derivative_along(V, y, driven(system, loads, w).rates(y))
    motion, at_rest = system.motion(y), system.motion(rest)
    E, F = ([], []) if held else (motion.E - at_rest.E, motion.F)
    z = np.concatenate([[1.0], E, y[size:] - rest[size:], motion.Omega, F, w])
    matrices = Matrices([forms.value(CROSS), forms.decrease(CROSS, RATE)])
    value, decrease = (M[..., 0] for M in matrices.at(y[:3, None]))
    still = z[: forms.still]
    expected = V(y), rate + float(RATE) * V(y)
    return expected, (still @ value @ still, -(z @ decrease @ z))


@pytest.mark.parametrize("loads", [(COUPLE,), (FORCE,), (COUPLE, FORCE)], ids=["N", "f", "both"])
@pytest.mark.parametrize("name", CONFIGS)
def test_the_forms_are_v_and_its_derivative_along_the_equations(name, loads):
    rng = np.random.default_rng(1)
    for _ in range(3):
        expected, values = numbers_at(CONFIGS[name], loads, rng)
        assert values == pytest.approx(expected, rel=1e-9, abs=1e-8)


def test_the_state_at_rest_is_one():
    config = CONFIGS["all"]
    system, rest = configurations(system_of(config)).system, forms_of_config(config).rest
    assert np.abs(rest[6:9]).max() > 0.01
    assert np.abs(rest[12:]).max() > 0.01
    assert system.rates(rest) == pytest.approx(np.zeros(system.size), abs=1e-9)


REASONS = {
    "not at Θ = 0": (config_data({}, HELD) | {"gravity": [0.0, 0.0, -9.81]}, "does not rest at"),
    "ligament": (config_data({"band": BAND}, HELD), "the force of band is not one smooth formula"),
    "stop": (
        config_data({"end": guard("stop", restitution=0.5, angle=1.2)}, HELD),
        "the force of end is not one smooth formula",
    ),
    "spring": (config_data({"strut": STRUT}), "not quadratic in positions"),
    "not held": (config_data({}, {"variant": "free"}), "nothing holds the position"),
    "input": (
        config_data(
            {
                "gust": {
                    "kind": "input",
                    "quantity": "couple",
                    "direction": [1, 0, 0],
                    "amplitude": 3,
                    "signal": {"kind": "sine", "frequency": 1},
                }
            },
            HELD,
        ),
        "the element gust supplies power",
    ),
}


@pytest.mark.parametrize("name", REASONS)
def test_other_bodies_have_no_forms_and_the_reason_is_said(name):
    data, reason = REASONS[name]
    with pytest.raises(NoFormsError, match=reason):
        forms_of_config(rbstab.load_config(data))


@pytest.mark.parametrize("surface", ["position", {"slope": 3}])
def test_a_sliding_connector_has_no_forms(surface):
    gains = {"K_s": [60, 60, 40], "surface": surface}
    data = config_data({}, {**HELD, "variant": "sliding", **gains})
    with pytest.raises(NoFormsError, match="connector is not one smooth formula"):
        forms_of_config(rbstab.load_config(data))
