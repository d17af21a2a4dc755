"""Protects the fingerprint of the equations: it changes with them, and with nothing else."""

from functools import partial

import pytest
from support.paper_runs import paper_config

import rbstab
from rbstab.analysis.fingerprint import fingerprint
from rbstab.config.build import system_of
from rbstab.elements.embedded import EmbeddedConnector
from rbstab.elements.gravity import Gravity
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.experiment.stored_proof.identity import proof_id
from rbstab.mechanics.motion import Wrench


def embedded():
    return rbstab.load_config(paper_config("embedded", with_gravity=True))


def of(config):
    return fingerprint(partial(system_of, config))


def scaled(method):
    """Return a method whose value is larger by one in 1e12."""

    def changed(*arguments):
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
        (EmbeddedConnector, "wrench"),
        (EmbeddedConnector, "dissipated"),
        (EmbeddedConnector, "rates"),
    ],
)
def test_a_changed_equation_changes_the_id(monkeypatch, element, method):
    config = embedded()
    before = proof_id(config)
    monkeypatch.setattr(element, method, scaled(getattr(element, method)))
    # A process computes it once for equal bodies: equations do not change while it runs.
    monkeypatch.setattr("rbstab.experiment.stored_proof.identity._FINGERPRINTS", {})
    assert proof_id(config) != before


def test_a_rearranged_equation_does_not(monkeypatch):
    config = embedded()
    before = of(config)

    def stored(self, motion, states):
        """Return ½ Σ K_ij θ_i θ_j, in another order, with an identity of sine and cosine."""
        first = motion.Theta[0]
        unity = first.sin() * first.sin() + first.cos() * first.cos()
        terms = [
            motion.Theta[j] * self.K_r[i, j] / 2 * motion.Theta[i]
            for j in range(3)
            for i in range(3)
        ]
        return unity * sum(terms)

    monkeypatch.setattr(RotationalStabilizer, "stored", stored)
    assert of(config) == before


@pytest.mark.parametrize(
    ("variant", "names"), [("permanent", ("manifold", "reduced")), ("free", ("Z", "W"))]
)
def test_equivalent_coordinates_have_the_same(variant, names):
    first, second = (rbstab.load_config(paper_config(variant, coordinates=name)) for name in names)
    assert proof_id(first) == proof_id(second)
