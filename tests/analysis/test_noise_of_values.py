"""Round-off of v: below its rest state, in the audit, and where v rises."""

from dataclasses import replace

import numpy as np
import pytest
from support.evidence import CONSISTENT, UNKNOWN, VIOLATED, check, settled

from rbstab.analysis.certificate.checks import breakpoints, decrease, supplied
from rbstab.analysis.exact import ball


def test_round_off_of_the_energies_is_allowed_below_rest():
    run = settled()
    terms = np.abs(run.energy[1]).sum()
    value = np.array([run.value[0], -8 * np.finfo(float).eps * terms])
    assert value[1] < -1e-12 * run.scale
    assert check(replace(run, value=value), "positive").verdict is CONSISTENT


@pytest.mark.parametrize("scale", [1.0, 1e4])
@pytest.mark.parametrize(("depth", "verdict"), [(2e-12, VIOLATED), (0.5e-12, UNKNOWN)])
def test_a_state_below_rest_is_violated(depth, verdict, scale):
    """The energy at rest is too high by a part of the scale; the stored v shows 1e-6 of it."""
    run = settled(scale=scale)
    value = np.array([run.value[0], -1e-6 * run.scale])
    exact = run.exact_rest_energy()
    wrong = replace(run, value=value, exact_rest_energy=lambda: exact + ball(depth * run.scale))
    assert check(wrong, "positive").verdict is verdict


def test_a_rest_state_that_is_not_accurate_violates_nothing():
    run = settled()
    value = np.array([run.value[0], -1e-6 * run.scale])
    exact = run.exact_rest_energy()
    below = replace(run, value=value, exact_rest_energy=lambda: exact + ball(1e-3 * run.scale))
    assert check(below, "positive").verdict is VIOLATED
    for changes in (
        {"rest": replace(run.rest, gradient=1e-8, load=1e-3)},
        {"approached": False},  # it approaches another rest state, and may end below this one
    ):
        assert check(replace(below, **changes), "positive").verdict is UNKNOWN
    unfound = replace(run, rest=replace(run.rest, gradient=1.0))
    assert check(unfound, "positive").verdict is UNKNOWN
    assert check(replace(unfound, has_potential=False), "positive").verdict is CONSISTENT


RISES = {
    "within the residual": (0.9e-8, 0.5e-8, CONSISTENT),
    "above the residual": (1.1e-8, 0.5e-8, VIOLATED),
    "within a residual that is too large": (1e-3, 1e-3, UNKNOWN),
    "above a residual that is too large": (3e-3, 1e-3, VIOLATED),
    "allowed by the tolerance, and a residual that is too large": (1.9e-8, 1e-3, CONSISTENT),
    "not allowed by the tolerance": (2.1e-8, 1e-3, UNKNOWN),
    "none, and a residual that is too large": (-1e-3, 1e-3, CONSISTENT),
}


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("case", RISES)
def test_a_rise_is_compared_with_the_residual(case, sign):
    rise, residual, verdict = RISES[case]
    run = settled()
    value = run.value[0] + np.array([0.0, rise * run.scale])
    changed = replace(run, value=value, residual=np.array([0.0, sign * residual * run.scale]))
    assert check(changed, "audit").verdict is (VIOLATED if residual > 1e-8 else CONSISTENT)
    checked = check(changed, "decrease")
    assert checked.verdict is verdict
    assert checked.value == pytest.approx(max(rise, 0.0), rel=1e-6)
    assert np.isnan(checked.when) if rise < 0 else checked.when == 0.0


@pytest.mark.parametrize(("share", "verdict"), [(1.0, CONSISTENT), (0.9, VIOLATED)])
def test_v_may_rise_by_what_is_supplied(share, verdict):
    run = settled()
    rise = 2.0 * run.scale
    risen = replace(run, value=np.array([0.0, rise]))
    checked = supplied(risen, np.array([0.0, share * rise]))
    assert checked.verdict is verdict
    assert checked.value == pytest.approx(2.0 * (1.0 - share), abs=1e-12)
    assert decrease(risen).verdict is VIOLATED


@pytest.mark.parametrize(
    ("reached", "missed", "first"),
    [([0.2, 0.5, 1.5], 0, np.nan), ([0.5], 1, 1.5), ([], 2, 0.5)],
)
def test_a_step_must_end_on_every_breakpoint(reached, missed, first):
    (checked,) = breakpoints(replace(settled(), breakpoints=[0.5, 1.5], reached=reached))
    assert checked.verdict is (VIOLATED if missed else CONSISTENT)
    assert checked.value == missed
    assert checked.when == pytest.approx(first, nan_ok=True)
