"""Round-off of dissipations and of eigenvalues of dampings; and what all checks have in common."""

from dataclasses import replace

import numpy as np
import pytest
from support.evidence import (
    CONSISTENT,
    UNKNOWN,
    VIOLATED,
    check,
    evidence,
    settled,
    state_of,
    states_of,
    stretched,
)
from support.rest import K_C, paper_system

from rbstab.analysis.certificate.verdict import overall
from rbstab.elements.sliding import SlidingConnector
from rbstab.elements.visco_elastic import ViscoElasticConnector


class Pump(ViscoElasticConnector):
    """A connector that adds energy and declares no damping."""

    gains = ()


class PumpWithoutBalls(Pump):
    """A pump that works only with numbers of numpy."""

    def dissipated(self, motion, states):
        if motion.F.dtype == object:
            raise TypeError("not a number of numpy")
        return super().dissipated(motion, states)


@pytest.mark.parametrize(("kind", "verdict"), [(Pump, VIOLATED), (PumpWithoutBalls, UNKNOWN)])
def test_a_part_that_adds_a_little_energy_is_violated(kind, verdict):
    system = paper_system("visco-elastic")
    system = replace(system, elements=(*system.elements[:-1], kind(K_C, -1e-3 * np.eye(3))))
    fast, slow = ([*np.zeros(9), speed, 0.0, 0.0] for speed in (1.0, 0.5))
    run = evidence(system, [state_of(system, np.array(Z)) for Z in (fast, slow)])
    checked = check(run, "damping")
    assert checked.verdict is verdict
    assert checked.value == pytest.approx(-1e-3, rel=1e-5)
    assert checked.when == run.times[int(run.dissipation[:, -1].argmin())]


def test_a_run_is_no_better_than_its_worst_check():
    line = check(settled(), "audit")
    of = {verdict: line._replace(verdict=verdict) for verdict in (CONSISTENT, UNKNOWN, VIOLATED)}
    assert overall([of[CONSISTENT], of[UNKNOWN]]) is UNKNOWN
    assert overall([of[UNKNOWN], of[VIOLATED], of[CONSISTENT]]) is VIOLATED
    assert overall([of[CONSISTENT], of[CONSISTENT]]) is CONSISTENT


def on_a_slope(system):
    """Return a system with a sliding connector on s = F + 20E, whose force has no potential."""
    mode = np.array([1.0, -1.0, 1.0])
    connector = SlidingConnector(
        K_s=np.full(3, 500.0), rate_weight=1.0, slope=20.0, layer_width=1.0, mode=mode
    )
    return replace(system, elements=(*system.elements, connector))


@pytest.mark.parametrize("slope", [False, True])
def test_the_power_of_the_contact_force_counts_only_without_a_potential(slope):
    """The exact comparison, too, adds F'Λ to ∇v·f if and only if v - ε replaces v."""
    system = stretched("free")
    if slope:
        system = on_a_slope(system)
    states = states_of(system)
    assert check(evidence(system, states, has_potential=not slope), "derivative").verdict is (
        CONSISTENT
    )
    if slope:
        assert check(evidence(system, states), "derivative").verdict is VIOLATED
