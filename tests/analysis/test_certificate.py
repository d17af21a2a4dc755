"""A certificate accepts sound runs, and its checks catch every kind of error."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from support.problems import problem, solve
from support.rest import system_of
from support.systems import VARIANTS, random_Z

from rbstab.analysis.certificate.evidence import audit_bound
from rbstab.analysis.certificate.verdict import Verdict, overall
from rbstab.analysis.lyapunov import energy_scale
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.visco_elastic import ViscoElasticConnector
from rbstab.experiment.record import record_of, rest_state_of
from rbstab.mechanics.motion import Wrench, motion_from_centre


def certified(system, *, engine="scipy", rtol=1e-10, duration=0.4, samples=21):
    """Return the verdicts of the checks by name, and the record, of a short random run."""
    rng = np.random.default_rng(5)
    motion = motion_from_centre(system.body, system.anchor, 0.3 * random_Z(rng))
    states = np.zeros(system.size - system.coordinates.size)
    times = np.linspace(0, duration, samples)
    given = problem(system, system.start(motion, states), times, rtol=rtol, atol=rtol)
    record = record_of(given, solve(engine, given), rest_state_of(given))
    return {check.check: check.verdict for check in record.checks}, record


NAMES = ["audit", "decrease", "damping", "positive", "derivative"]


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_sound_run_is_consistent_in_every_line(variant):
    lines, record = certified(system_of(variant))
    assert list(lines) == NAMES
    assert set(lines.values()) == {Verdict.CONSISTENT}
    assert verdict(record) is Verdict.CONSISTENT


def verdict(record):
    return overall(record.checks)


def value_of(record, name, column="value"):
    (check,) = [check for check in record.checks if check.check == name]
    return getattr(check, column)


def test_the_margin_of_the_damping_is_its_smallest_eigenvalue():
    system = system_of("embedded")
    _, record = certified(system)
    matrices = [system.elements[1].L_t, system.elements[2].L_r]
    matrices += [system.elements[3].L_c, system.elements[3].L_d]
    expected = min(np.linalg.eigvalsh(matrix)[0] for matrix in matrices)
    assert value_of(record, "damping") == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("method", "factor"), [("wrench", -1), ("stored", 2), ("dissipated", 0.5)])
def test_an_element_that_says_what_it_does_not_do_is_caught(method, factor):
    """It pushes where it should pull, or reports twice its energy, or half of its dissipation."""
    right = getattr(ViscoElasticConnector, method)

    def wrong(self, motion, states):
        statement = right(self, motion, states)
        return (
            Wrench(*(factor * x for x in statement)) if method == "wrench" else factor * statement
        )

    kind: Any = type("Wrong", (ViscoElasticConnector,), {method: wrong})
    system = system_of("visco-elastic")
    *others, connector = system.elements
    wrongly = replace(system, elements=(*others, kind(connector.K_c, connector.L_c)))
    lines, record = certified(wrongly, duration=0.05)
    assert lines["derivative"] == "violated"
    assert lines["audit"] == "violated"
    assert verdict(record) is Verdict.VIOLATED


@pytest.mark.parametrize(("rtol", "bound"), [(1e-12, 1e-8), (1e-10, 1e-6), (1e-3, 1e-2)])
def test_a_coarse_integration_is_not_blamed_on_the_argument(rtol, bound):
    assert audit_bound(rtol) == pytest.approx(bound)


@dataclass(frozen=True, eq=False)
class Pushing(RotationalStabilizer):
    """A stabilizer that adds energy and reports it: all formulas are right, and v rises."""

    def wrench(self, motion, states):
        return (
            super()
            .wrench(motion, states)
            ._replace(couple=-(motion.B.T @ (self.K_r @ motion.Theta)) + self.L_r @ motion.Omega)
        )

    def dissipated(self, motion, states):
        return -super().dissipated(motion, states)


def test_a_rise_of_v_is_caught_where_it_is_steepest():
    system = system_of("free")
    gravity, holding, turning = system.elements
    holding = replace(holding, L_t=1e-3 * holding.L_t)
    pushing = Pushing(turning.K_r, 0.1 * turning.L_r)
    system = replace(system, elements=(gravity, holding, pushing))
    lines, record = certified(system, duration=0.1)
    assert lines["derivative"] == "consistent"
    assert lines["audit"] == "consistent"
    assert lines["decrease"] == "violated"
    v, times = record.variables["lyapunov"].data, record.variables["time"].data
    steepest, scale = (
        int(np.diff(v).argmax()),
        energy_scale(v, record.variables["energy_round_off"].data),
    )
    assert value_of(record, "decrease", "when") == times[steepest]
    assert value_of(record, "decrease") == pytest.approx((v[steepest + 1] - v[steepest]) / scale)
