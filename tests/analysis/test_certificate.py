"""A certificate accepts sound runs, and its checks catch every kind of error."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from support.problems import problem, solve
from support.rest import system_of
from support.systems import VARIANTS, random_Z

from rbstab.analysis.certificate.checks import checks_of
from rbstab.analysis.certificate.evidence import Evidence, audit_bound
from rbstab.analysis.certificate.verdict import Verdict, overall
from rbstab.analysis.exact import ball
from rbstab.analysis.lyapunov import energy_scale
from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.elements.element import force_at_contact
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.visco_elastic import ViscoElasticConnector
from rbstab.experiment.record import record_of
from rbstab.mechanics.motion import motion_from_centre


def certified(system, *, engine="scipy", rtol=1e-10, duration=0.4, samples=21):
    """Return the verdicts of the checks by name, and the record, of a short random run."""
    rng = np.random.default_rng(5)
    motion = motion_from_centre(system.body, system.anchor, 0.3 * random_Z(rng))
    own = np.zeros(system.size - system.coordinates.size)
    times = np.linspace(0, duration, samples)
    given = problem(system, system.start(motion, own), times, rtol=rtol, atol=rtol)
    record = record_of(given, solve(engine, given))
    return {check.name: check.verdict for check in record.checks}, record


def with_connector(system, change):
    elements = [change(e) if e.name == "connector" else e for e in system.elements]
    return replace(system, elements=tuple(elements))


NAMES = ["audit", "decrease", "damping", "positive", "derivative"]


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_sound_run_is_consistent_in_every_line(variant):
    lines, record = certified(system_of(variant))
    assert list(lines) == NAMES
    assert set(lines.values()) == {Verdict.CONSISTENT}
    assert verdict(record) is Verdict.CONSISTENT


def verdict(record):
    return overall(record.checks)


def found(record, name, column="value"):
    (check,) = [check for check in record.checks if check.name == name]
    return getattr(check, column)


def test_the_margin_of_the_damping_is_its_smallest_eigenvalue():
    system = system_of("embedded")
    _, record = certified(system)
    matrices = [system.elements[1].L_t, system.elements[2].L_r]
    matrices += [system.elements[3].L_c, system.elements[3].L_d]
    expected = min(np.linalg.eigvalsh(matrix)[0] for matrix in matrices)
    assert found(record, "damping") == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("variant", "name"), [("visco-elastic", "L_c"), ("embedded", "L_c"), ("embedded", "L_d")]
)
def test_a_negative_damping_is_caught(variant, name):
    def change(connector):
        damping = getattr(connector, name).copy()
        damping[2, 2] = -abs(damping[2, 2])
        return replace(connector, **{name: damping})

    lines, record = certified(with_connector(system_of(variant), change), duration=0.02)
    assert lines["damping"] == "violated"
    assert lines["derivative"] == "consistent"
    assert verdict(record) is Verdict.VIOLATED


@dataclass(frozen=True, eq=False)
class WrongSpring(ViscoElasticConnector):
    """A spring that pushes where it should pull."""

    def wrench(self, motion, own):
        return force_at_contact(self.K_c @ motion.E - self.L_c @ motion.F)


@dataclass(frozen=True, eq=False)
class WrongEnergy(ViscoElasticConnector):
    """A connector that reports twice the energy that it stores."""

    def stored(self, motion, own):
        return 2.0 * super().stored(motion, own)


@dataclass(frozen=True, eq=False)
class WrongPower(ViscoElasticConnector):
    """A connector that reports half the power that it dissipates."""

    def dissipated(self, motion, own):
        return 0.5 * super().dissipated(motion, own)


@pytest.mark.parametrize("wrong", [WrongSpring, WrongEnergy, WrongPower])
def test_an_element_that_says_what_it_does_not_do_is_caught(wrong):
    system = with_connector(system_of("visco-elastic"), lambda c: wrong(c.K_c, c.L_c))
    lines, record = certified(system, duration=0.05)
    assert lines["derivative"] == "violated"
    assert lines["audit"] == "violated"
    assert verdict(record) is Verdict.VIOLATED


@dataclass(frozen=True, eq=False)
class Pushing(RotationalStabilizer):
    """A stabilizer that adds energy and reports it: all formulas are right, and v rises."""

    def wrench(self, motion, own):
        return (
            super()
            .wrench(motion, own)
            ._replace(couple=-(motion.B.T @ (self.K_r @ motion.Theta)) + self.L_r @ motion.Omega)
        )

    def dissipated(self, motion, own):
        return -super().dissipated(motion, own)


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
    assert found(record, "decrease", "time") == times[steepest]
    assert found(record, "decrease") == pytest.approx((v[steepest + 1] - v[steepest]) / scale)


def test_a_value_below_rest_is_caught():
    """v is negative if it is counted from a state that is not the lowest."""
    system = system_of("free")
    rng = np.random.default_rng(5)
    motion = motion_from_centre(system.body, system.anchor, 0.3 * random_Z(rng))
    given = problem(system, system.start(motion, np.zeros(0)), np.linspace(0, 0.2, 11))
    trajectory = solve("scipy", given)
    record = record_of(given, trajectory).variables
    end = record["lyapunov"].data[-1]
    rest_energy = record["energy_at_rest"].data + 1.001 * end
    evidence = Evidence(
        times=trajectory.times,
        states=trajectory.states,
        systems=(system,) * 11,
        value=record["lyapunov"].data - 1.001 * end,
        rate=record["lyapunov_rate"].data,
        dissipation=record["dissipation"].data,
        residual=record["energy_residual"].data,
        energy=record["energy"].data,
        rest=nearest_rest_state(system),
        approached=True,
        exact_rest_energy=lambda: ball(float(rest_energy)),
        scale=1.0,
        has_potential=True,
        audit_bound=1e-8,
    )
    lines = {check.name: check for check in checks_of(evidence)}
    assert lines["positive"].verdict is Verdict.VIOLATED
    assert lines["positive"].time == trajectory.times[-1]
    # A motion that approaches no rest state in the range may have less energy than the known one.
    elsewhere = {c.name: c for c in checks_of(replace(evidence, approached=False))}
    assert elsewhere["positive"].verdict is Verdict.UNKNOWN
    without = {c.name: c for c in checks_of(replace(evidence, has_potential=False))}
    assert without["positive"].verdict is Verdict.CONSISTENT


@pytest.mark.parametrize(("rtol", "bound"), [(1e-12, 1e-8), (1e-10, 1e-6), (1e-3, 1e-2)])
def test_a_coarse_integration_is_not_blamed_on_the_argument(rtol, bound):
    assert audit_bound(rtol) == pytest.approx(bound)
    if rtol > 1e-11:
        lines, _ = certified(system_of("free"), rtol=rtol)
        assert lines["audit"] == "consistent"
