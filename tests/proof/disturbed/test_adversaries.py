"""Protects that loads which raise V as fast as they can break no bound of any body.

V and the power of the loads are those of the forms (`test_forms` holds them against the equations).
"""

from fractions import Fraction

import numpy as np
import pytest
from support.disturbed import (
    COUPLE,
    FORCE,
    forms_of_config,
    full_config,
    sprung_config,
    tied_config,
)

from rbstab.analysis.configuration import configurations
from rbstab.config.build import system_of
from rbstab.experiment.disturbed.breaking import rates_of_many
from rbstab.experiment.disturbed.prove_bound import prove_bound
from rbstab.mechanics.attitude import rotations, tilt
from rbstab.mechanics.derivatives import jacobian
from rbstab.proof.disturbed.forms import driven
from rbstab.proof.disturbed.matrices import Matrices

BODIES = {
    "springs": (sprung_config(), {COUPLE: Fraction(60)}),
    "tied": (tied_config("visco-elastic"), {COUPLE: Fraction(105)}),
    "embedded": (tied_config("embedded"), {COUPLE: Fraction(60), FORCE: Fraction(50)}),
    "all": (full_config(), {COUPLE: Fraction(60), FORCE: Fraction(60)}),
}
SIZES = np.repeat([0.3, 2.0, 0.03, 0.3], 3)
"""Of Θ, Ω, X and V of starts, before they are scaled to V = ℓ."""

MEMBERS = 40


class Body:
    """A body with V and what loads do to it, of many states."""

    def __init__(self, config, loads, claim):
        forms, self.level = forms_of_config(config, *loads), float(claim.level)
        self.system = configurations(system_of(config)).system
        self.rest, self.n = forms.rest, self.system.size
        self.forms = Matrices([forms.value(claim.cross), forms.decrease(claim.cross, claim.rate)])

        def rates(y):
            return driven(self.system, loads, y[self.n :]).rates(y[: self.n])

        self.rates = rates_of_many(rates, self.n + 3 * len(loads))

    def z(self, y):
        """Return (1, E - E*, own - own*, Ω, F), or that without E and F."""
        system, unity = self.system, np.ones((1, y.shape[1]))
        size = system.coordinates.size
        shift = y[size:] - self.rest[size:, None]
        if system.coordinates.holds_contact:
            return np.concatenate([unity, shift, y[3:6]])
        A, R = np.moveaxis(rotations(y[:3].T), 0, 2), system.body.contact_point[:, None]
        E = y[6:9] - self.rest[6:9, None] + np.einsum("ijm,jk->im", A, R) - R
        F = y[9:12] + np.einsum("ijm,jm->im", A, np.cross(y[3:6], R, axis=0))
        return np.concatenate([unity, E, shift, y[3:6], F])

    def value_and_pull(self, y):
        """Return V, and its derivative by the loads: half of the rate that each adds."""
        value, decrease = self.forms.at(y[:3])
        z = self.z(y)
        V = np.einsum("im,ijm,jm->m", z, value, z)
        return V, -np.einsum("ijm,jm->im", decrease[len(z) :, : len(z)], z)

    def starts(self, rng, angle):
        """Return states with V just below ℓ, and a smaller tilt."""
        sizes = np.append(SIZES, np.full(3, 0.02))[: self.n]
        away = rng.normal(size=(self.n, MEMBERS)) * sizes[:, None]
        low, high = np.zeros(MEMBERS), np.full(MEMBERS, 3.0)
        for _ in range(40):
            middle = 0.5 * (low + high)
            y = self.rest[:, None] + middle * away
            inside = (self.value_and_pull(y)[0] < self.level) & (tilts(y) < angle)
            low, high = np.where(inside, middle, low), np.where(inside, high, middle)
        return self.rest[:, None] + 0.99999 * low * away


def tilts(y):
    return tilt(y[:3].T, np.zeros(3))


@pytest.mark.heavy
@pytest.mark.parametrize("name", BODIES)
def test_loads_that_raise_v_as_fast_as_they_can_break_no_bound(name):
    config, loads = BODIES[name]
    claim = prove_bound(config, loads, Fraction(1, 2)).claim
    assert claim is not None
    body, rng = Body(config, tuple(loads), claim), np.random.default_rng(0)
    y = body.starts(rng, 0.5)
    assert body.value_and_pull(y)[0].max() > 0.999 * body.level
    h = 0.3 / np.abs(np.linalg.eigvals(jacobian(body.system.rates, body.rest))).max()
    fixed = rng.normal(size=(3 * len(loads), MEMBERS // 2))
    for k in range(int(0.6 / h)):
        V, pull = body.value_and_pull(y)
        assert np.all(body.level > V)
        assert np.all(tilts(y) < 0.5)
        pull[:, MEMBERS // 2 :] = fixed * np.sign(np.sin(9.0 * k * h))
        parts = pull.reshape(-1, 3, MEMBERS)
        lengths = np.maximum(np.linalg.norm(parts, axis=1, keepdims=True), 1e-12)
        sizes = np.array(claim.sizes, dtype=float)[:, None, None]
        w = (sizes * parts / lengths).reshape(-1, MEMBERS)

        def rates(y, w=w):
            return body.rates(np.concatenate([y, w]))

        a = rates(y)
        b = rates(y + 0.5 * h * a)
        c = rates(y + 0.5 * h * b)
        y = y + h / 6.0 * (a + 2.0 * (b + c) + rates(y + h * c))
