"""Protects the fingerprint of the equations: it changes with them, and with nothing else."""

from functools import partial
from typing import Any

import numpy as np
import pytest
from support.config_elements import config_data
from support.paper_runs import CASE_NAMES, CASES, paper_config

import rbstab
from rbstab.analysis.fingerprint import P, Residue, fingerprint, residue
from rbstab.config.build import system_of
from rbstab.config.schema import Config
from rbstab.elements.attitude_spring import AttitudeSpring
from rbstab.elements.embedded import EmbeddedConnector
from rbstab.elements.gravity import Gravity
from rbstab.elements.guards.barrier import Barrier
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.spring import Spring
from rbstab.elements.visco_elastic import ViscoElasticTie
from rbstab.experiment.stored_proof.identity import proof_id
from rbstab.mechanics import attitude
from rbstab.mechanics.motion import Wrench
from rbstab.mechanics.numbers import sqrt


def embedded() -> Config:
    return rbstab.load_config(paper_config("embedded", with_gravity=True))


def of(config: Config) -> str:
    return fingerprint(partial(system_of, config))


def scaled(method: Any) -> Any:
    """Return a method whose value is larger by one in 1e12."""

    def changed(*arguments: Any) -> Any:
        value = method(*arguments)
        factor = 1 + 2.0**-40
        if isinstance(value, Wrench):
            return Wrench(*(part * factor for part in value))
        return value * factor

    return changed


@pytest.mark.parametrize(
    ("element", "method"),
    [
        (Gravity, "stored"),
        (Gravity, "wrench"),
        (RotationalStabilizer, "stored"),
        (RotationalStabilizer, "wrench"),
        (RotationalStabilizer, "dissipated"),
        (EmbeddedConnector, "stored"),
        (EmbeddedConnector, "wrench"),
        (EmbeddedConnector, "dissipated"),
        (EmbeddedConnector, "rates"),
    ],
)
def test_a_changed_equation_changes_the_id(
    monkeypatch: pytest.MonkeyPatch, element: type, method: str
) -> None:
    config = embedded()
    before = proof_id(config)
    monkeypatch.setattr(element, method, scaled(getattr(element, method)))
    # A process computes it once for equal bodies: equations do not change while it runs.
    monkeypatch.setattr("rbstab.experiment.stored_proof.identity._KNOWN_EQUATIONS", {})
    assert proof_id(config) != before


@pytest.mark.parametrize("method", ["stored", "wrench", "dissipated"])
@pytest.mark.parametrize("kind", [Spring, ViscoElasticTie, AttitudeSpring, Barrier])
def test_a_changed_equation_of_an_element_changes_it(
    monkeypatch: pytest.MonkeyPatch, kind: type, method: str
) -> None:
    config = rbstab.load_config(config_data())
    before = of(config)
    assert of(config) == before
    monkeypatch.setattr(kind, method, scaled(getattr(kind, method)))
    # A guard loses nothing, so its dissipation is zero, scaled or not.
    assert (of(config) == before) == (kind is Barrier and method == "dissipated")


def test_a_rearranged_equation_of_a_spring_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    """½ k (ℓ² - 2ℓℓ₀ + ℓ₀²), the same square written out."""
    config = rbstab.load_config(config_data())
    before = of(config)

    def stored(self: Spring, motion: Any, own: Any) -> Any:
        e = motion.X + motion.A @ self.point - self.anchor
        length, rest = sqrt(e @ e), self.rest_length
        return (length * length - 2 * rest * length + rest * rest) * self.stiffness / 2

    monkeypatch.setattr(Spring, "stored", stored)
    assert of(config) == before


def test_square_root_of_a_residue() -> None:
    """Half of all residues have a root; of the others, it is that of -x."""
    signs = set()
    for value in range(2, 40):
        x = residue(value) / 7
        root = x.sqrt()
        square = (root * root).value
        assert square in {x.value, (-x).value}
        signs.add(square == x.value)
    assert signs == {True, False}


def test_a_rearranged_equation_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    config = embedded()
    before = of(config)

    def stored(self: RotationalStabilizer, motion: Any, own: Any) -> Any:
        """Return ½ Σ K_ij θ_i θ_j, in another order, with an identity of sine and cosine."""
        first = motion.Theta[0]
        one = first.sin() * first.sin() + first.cos() * first.cos()
        terms = [
            motion.Theta[j] * self.K_r[i, j] / 2 * motion.Theta[i]
            for j in range(3)
            for i in range(3)
        ]
        return one * sum(terms)

    monkeypatch.setattr(RotationalStabilizer, "stored", stored)
    assert of(config) == before


@pytest.mark.parametrize(("variant", "with_gravity"), CASES, ids=CASE_NAMES)
def test_each_variant_has_one(variant: str, with_gravity: bool) -> None:
    config = rbstab.load_config(paper_config(variant, with_gravity))
    assert of(config) == of(config)
    others = [rbstab.load_config(paper_config(*case)) for case in CASES]
    assert sum(of(other) == of(config) for other in others) == 1


@pytest.mark.parametrize(
    ("variant", "names"), [("permanent", ("manifold", "reduced")), ("free", ("Z", "W"))]
)
def test_equivalent_coordinates_have_the_same(variant: str, names: tuple[str, str]) -> None:
    one, two = (rbstab.load_config(paper_config(variant, coordinates=name)) for name in names)
    assert proof_id(one) == proof_id(two)


def test_residues_are_numbers() -> None:
    """1/2 + 1/3 - 5/6 = 0, and so on: exact, with doubles and integers on either side."""
    half, third = residue(1) / 2, 1 / residue(3)
    assert (half + third - 5 / residue(6)).value == 0
    assert (0.5 - half).value == 0
    assert (-(third * 3.0) + 1).value == 0
    assert (np.array([2.0, 4.0], dtype=object) * half)[1].value == 2
    angle = Residue(17, 12345)
    assert (angle.sin() * angle.sin() + angle.cos() * angle.cos()).value == 1
    assert angle.sin().value not in {0, 1, P - 1}
    assert (half.exp() - (half + 0).exp()).value == 0
    assert len({half.exp().value, half.log().value, third.exp().value}) == 3


def test_the_attitude_is_part_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """The sign of B is in the wrench of the rotational stabilizer and in the rates."""
    before = of(embedded())
    original = attitude.rate_matrix
    monkeypatch.setattr(attitude, "rate_matrix", lambda Theta: -original(Theta))
    assert of(embedded()) != before
