"""Protects the checker's bounds on the length of a line, which share no formula with the prover."""

import numpy as np
import pytest
from flint import arb, ctx
from support.held_springs import held_system, length_of, random_springs
from support.proofs import findings_of, proof_of

from rbstab.analysis.proof_check import energy
from rbstab.analysis.proof_check.checker import check
from rbstab.analysis.proof_check.energy import Energy
from rbstab.analysis.proof_check.lengths import lines
from rbstab.analysis.proof_check.lengths.lines import Line
from rbstab.analysis.proof_check.trigonometric import ORDERS, TrigonometricSum

NONE = [0.0, 0.0, 0.0]
CIRCLE = [[[5.0, 0.0, 0.0], NONE, NONE], [[4.0, 0.0, 0.0], NONE, NONE], [NONE, NONE, NONE]]
"""s = 5 + 4 cos θ1, the square of the distance of two points, 2 m and 1 m from an axis."""


@pytest.fixture(autouse=True)
def _precision():
    with ctx.workprec(300):
        yield


def circle(radius=0.0):
    """Return the derivatives of the length √(5 + 4 cos θ1), of weight 3, about θ1 = 0.7."""
    Theta = [arb(0.7, radius), arb(0.2, radius), arb(-1, radius)]
    return Line({"weight": 3.0, "coefficients": CIRCLE}).derivatives(Theta)


def test_derivatives_are_those_of_the_closed_form():
    x = arb(0.7)
    sine, cosine = x.sin(), x.cos()
    s = 5 + 4 * cosine
    length = s.sqrt()
    exact = [
        length,
        -2 * sine / length,
        -2 * cosine / length - 4 * sine * sine / (s * length),
        2 * sine / length - 12 * sine * cosine / (s * length) - 24 * sine**3 / (s * s * length),
    ]
    for radius in (0.0, 1e-3):
        found = circle(radius)
        for order, value in enumerate(exact):
            assert found[(0,) * order].contains(3 * value)
            assert found[(0,) * order].rad() < 1e-12 + 100 * radius
    assert all(value.contains(0) for axes, value in circle().items() if 1 in axes or 2 in axes)


@pytest.mark.parametrize("seed", range(3))
def test_bounds_over_a_ball_contain_those_at_its_points(seed):
    rng = np.random.default_rng(seed)
    (spring,) = random_springs(rng, 1)
    data = proof_of(held_system([spring]), box_limit=1)["reduced_energy"]["lines"][0]
    line, centre = Line(data), rng.uniform(-2, 2, 3)
    over = line.derivatives([arb(x, 0.1) for x in centre])
    for _ in range(20):
        Theta = centre + rng.choice([-0.1, 0.1, 0.03], 3)
        at_point = line.derivatives([arb(x) for x in Theta])
        assert all(over[axes].overlaps(at_point[axes]) for axes in ORDERS)
        length = float(at_point[()]) / data["weight"]
        assert length == pytest.approx(length_of(spring, Theta), rel=1e-12)
        for axis in range(3):
            assert abs(at_point[axis,]) <= line.steepest(axis)


def test_mixed_derivatives_are_differences():
    (spring,) = random_springs(np.random.default_rng(5), 1)
    data = proof_of(held_system([spring]), box_limit=1)["reduced_energy"]["lines"][0]
    line, centre, h = Line(data), [arb(0.3), arb(-0.4), arb(1.1)], arb(2) ** -14
    found = line.derivatives(centre)
    for axes in [axes for axes in ORDERS if axes]:
        ahead, behind = (
            line.derivatives([x + sign * h * (k == axes[-1]) for k, x in enumerate(centre)])
            for sign in (1, -1)
        )
        difference = (ahead[axes[:-1]] - behind[axes[:-1]]) / (2 * h)
        assert float(difference) == pytest.approx(float(found[axes]), rel=1e-5, abs=1e-3)


def test_a_line_that_may_have_no_length_has_no_bounds_and_is_refused(monkeypatch):
    touching = [[[4.0, 0.0, 0.0], NONE, NONE], CIRCLE[1], CIRCLE[2]]
    line = Line({"weight": 3.0, "coefficients": touching})
    over = line.derivatives([arb(np.pi, 0.1), arb(0), arb(0)])
    assert not over[0,].is_finite()
    (spring,) = random_springs(np.random.default_rng(0), 1)
    proof = proof_of(held_system([spring]), box_limit=1)
    proof["reduced_energy"]["lines"] = [{"weight": 3.0, "coefficients": touching}]
    monkeypatch.setattr(lines, "BOX_LIMIT", 2000)
    (finding,) = check(proof)
    assert (finding.claim, finding.verified) == ("lines", False)


def test_multiples_of_an_angle_and_too_many_lines_are_refused(monkeypatch):
    double = np.zeros((5, 5, 5))
    double[0, 0, 0], double[3, 0, 0] = 3.0, 1.0
    with pytest.raises(ValueError, match="multiple of an angle"):
        Line({"weight": 1.0, "coefficients": double.tolist()})
    monkeypatch.setattr(energy, "MOST_LINES", 1)
    data = {"quadratic": np.eye(3).tolist(), "linear": [0.0] * 3, "coefficients": [[[0.0]]]}
    Energy(data | {"lines": [{"weight": 1.0, "coefficients": CIRCLE}]})
    with pytest.raises(ValueError, match="more than 1 lines"):
        Energy(data | {"lines": 2 * [{"weight": 1.0, "coefficients": CIRCLE}]})


def test_steepest_bounds_the_slope_of_a_sum():
    total = TrigonometricSum(CIRCLE)
    assert abs(total.steepest(0) - 4) < 1e-12
    assert total.steepest(1) < 1e-300
    # The slope of √(5 + 4 cos θ) is 1 at most, where cos θ = -1/2; the bound of lemma 7 is √2.
    assert abs(Line({"weight": 1.0, "coefficients": CIRCLE}).steepest(0) - arb(2).sqrt()) < 1e-12


@pytest.fixture(scope="module")
def proof():
    """The proof of a body with a spring: a minimum and other rest states, and a region."""
    springs = random_springs(np.random.default_rng(1), 1)
    return proof_of(held_system(springs, 1.0))


@pytest.mark.heavy
def test_a_proof_with_a_spring_is_verified(proof):
    assert proof["proved"]
    assert {finding.claim for finding in findings_of(proof)} >= {"lines", "certified region"}
    assert all(finding.verified for finding in findings_of(proof))


@pytest.mark.heavy
@pytest.mark.parametrize("case", ["weight", "square", "no line", "a state less", "level"])
def test_a_forged_proof_with_a_spring_is_refused(proof, case):
    forged = {**proof, "reduced_energy": dict(proof["reduced_energy"]), "regions": []}
    (line,) = forged["reduced_energy"]["lines"]
    if case == "weight":
        forged["reduced_energy"]["lines"] = [{**line, "weight": 0.999 * line["weight"]}]
    elif case == "square":
        moved = np.array(line["coefficients"])
        moved[0, 0, 0] += 1e-3
        forged["reduced_energy"]["lines"] = [{**line, "coefficients": moved.tolist()}]
    elif case == "no line":
        del forged["reduced_energy"]["lines"]
    elif case == "a state less":
        forged["states"] = forged["states"][:-1]
        forged["unique"] = len(forged["states"]) == 1
    else:
        raised = proof["region"]["energy_bound"] * (1 + 1e-6)
        forged["region"] = {**proof["region"], "energy_bound": raised}
    assert not all(finding.verified for finding in check(forged))
