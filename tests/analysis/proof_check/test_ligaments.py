"""Protects the checker's energies of ligaments: against other formulas and false claims."""

import copy

import numpy as np
import pytest
from flint import arb, ctx
from hypothesis import given, settings
from hypothesis import strategies as st
from rbstab.experiment.stored_proof.written_energies import energy_of
from support.held_springs import held_system
from support.ligaments import (
    held_energy,
    least_tied_energy,
    ligament_of,
    random_ligaments,
    stored,
    tension,
)
from support.proofs import proof_of
from support.tied_springs import tied_system

from rbstab.analysis.proof.reduced_energy import reduced_energy
from rbstab.analysis.proof_check.checker import check
from rbstab.analysis.proof_check.energy import Energy
from rbstab.analysis.proof_check.lengths.free_ligaments import FreeLigaments, Over
from rbstab.analysis.proof_check.lengths.ligaments import LigamentLaw
from rbstab.analysis.proof_check.lengths.small_matrices import cholesky, inverse, product, turned
from rbstab.analysis.proof_check.taylor import Taylor


@pytest.fixture(autouse=True)
def _precision():
    with ctx.workprec(128):
        yield


def data_of(system):
    """Return the energy of a system as it stands in a proof."""
    return energy_of(reduced_energy(system).form).model_dump(mode="json")


LIGAMENT = ligament_of(stiffness=400.0, slack_length=0.3, toe_strain=0.05)


def law_of(ligament):
    return LigamentLaw(vars(ligament))


@pytest.mark.parametrize("ratio", [0.5, 0.99, 1.01, 1.05, 1.0999, 1.11, 1.5, 3.0])
def test_the_law_is_the_one_of_the_paper(ratio):
    length = ratio * LIGAMENT.slack_length
    energy, first, second, third = law_of(LIGAMENT).derivatives(arb(length))
    assert float(energy) == pytest.approx(stored(LIGAMENT, length), rel=1e-10, abs=1e-14)
    assert float(first) == pytest.approx(tension(LIGAMENT, length), rel=1e-12)
    h = 1e-6
    near = [float(law_of(LIGAMENT).derivatives(arb(length + one))[1]) for one in (-h, h)]
    assert float(second) == pytest.approx((near[1] - near[0]) / (2 * h), rel=1e-6, abs=1e-6)
    near = [float(law_of(LIGAMENT).derivatives(arb(length + one))[2]) for one in (-h, h)]
    assert float(third) == pytest.approx((near[1] - near[0]) / (2 * h), rel=1e-6, abs=1e-3)


@settings(max_examples=50, deadline=None)
@given(st.floats(0.8, 2.0), st.floats(0.0, 0.6), st.floats(0, 1))
def test_balls_contain_the_values_inside(low, width, share):
    law, slack = law_of(LIGAMENT), LIGAMENT.slack_length
    ball = arb(low * slack).union(arb((low + width) * slack))
    inside = arb((low + share * width) * slack)
    for over, at in zip(law.derivatives(ball), law.derivatives(inside), strict=True):
        assert over.overlaps(at)
    if low >= 1:
        across, excess = law.across_and_excess(ball)
        first, second = law.derivatives(inside)[1:3]
        assert across.overlaps(first / inside)
        assert excess.overlaps(second - first / inside)


@pytest.mark.parametrize(
    ("low", "high"), [(1.0, 1.02), (1.01, 1.09), (1.05, 1.2), (1.12, 1.3), (1.0, 1.4)]
)
def test_balls_in_each_part_of_the_law_contain_the_values_inside(low, high):
    law, slack = law_of(LIGAMENT), LIGAMENT.slack_length
    across, excess = law.across_and_excess(arb(low * slack).union(arb(high * slack)))
    for ratio in np.linspace(low, high, 41)[1:-1]:
        inside = arb(float(ratio) * slack)
        first, second = law.derivatives(inside)[1:3]
        assert across.overlaps(first / inside)
        assert excess.overlaps(second - first / inside)


@pytest.mark.parametrize(
    ("share", "radius"), [(1.0, 1e-5), (1.0, 0.005), (0.5, 0.005), (0.0, 0.005)]
)
def test_what_is_computed_in_doubles_need_not_be_accurate(monkeypatch, share, radius):
    """With another ẑ, C and B, bounds are wider, and contain what they did."""
    rng = np.random.default_rng(8)
    U = Energy(data_of(tied_system(random_ligaments(rng, 2, 3e3))))
    places = []
    for centre in rng.uniform(-1.2, 1.2, size=(20, 3)):
        Theta = centre + rng.uniform(-radius, radius, size=3)
        points = [Taylor(U, tuple((x, x) for x in one.tolist())) for one in (centre, Theta)]
        places.append((centre, *points))
    shift, chosen = FreeLigaments.shift, Over._chosen

    def moved(self, r):
        z, bend = shift(self, r)
        return [one + 1e-3 for one in z], bend

    def turned_less(self, z, bend):
        C, B = chosen(self, z, bend)
        return [[share * one for one in row] for row in C], [
            [0.9 * one for one in row] for row in B
        ]

    monkeypatch.setattr(FreeLigaments, "shift", moved)
    monkeypatch.setattr(Over, "_chosen", turned_less)
    away = 0.0
    for centre, at_centre, inside in places:
        wide = Taylor(U, tuple((one - radius, one + radius) for one in centre.tolist()))
        assert wide.value.overlaps(at_centre.value)
        assert wide.value.rad() > 1e-6
        away = max(away, float(abs(wide.gradient[0, 0] - at_centre.gradient[0, 0]).upper()))
        for i in range(3):
            assert wide.gradient[i, 0].overlaps(at_centre.gradient[i, 0])
            assert wide.whole_gradient[i, 0].overlaps(inside.gradient[i, 0])
            for j in range(3):
                assert wide.whole_hessian[i, j].overlaps(inside.hessian[i, j])
    assert away > 1e-3


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32), st.floats(1e-3, 0.2), st.sampled_from([300.0, 3e3, 3e5]))
def test_the_shift_of_the_position_is_bounded(seed, radius, stiffest):
    """ζ = z - ẑ - Cδ is where it is said to be, by Krawczyk's test or by strong convexity."""
    rng = np.random.default_rng(seed)
    ligaments = random_ligaments(rng, 2, stiffest)
    V = Energy(data_of(tied_system(ligaments))).position
    free = reduced_energy(tied_system(ligaments)).ligaments
    assert V is not None
    assert free is not None
    centre = rng.uniform(-1.2, 1.2, size=3)
    with ctx.workprec(128):
        middle, ball = [arb(one) for one in centre.tolist()], arb(0, radius)
        over = V.over(middle, [ball] * 3)
        found = over._near(over._second([arb(0)] * 3))
        if found is None:
            return
        C = np.array([[float(one.mid()) for one in row] for row in over.place.C])
        z = np.array([float(one.mid()) for one in over.place.z])
        for _ in range(6):
            step = rng.uniform(-radius, radius, size=3)
            zeta = free.shift((centre + step)[np.newaxis])[0] - z - C @ step
            for one, width in zip(zeta, found[2], strict=True):
                assert abs(one) <= float(width.abs_upper()) + 1e-12


def test_a_wrong_number_is_refused():
    for name in ("stiffness", "slack_length", "toe_strain"):
        with pytest.raises(ValueError, match="not positive"):
            LigamentLaw(vars(LIGAMENT) | {name: 0.0})


@pytest.mark.parametrize("seed", range(3))
def test_energies_of_a_held_body_are_those_of_other_formulas(seed):
    rng = np.random.default_rng(seed)
    ligaments = random_ligaments(rng, 2)
    U = Energy(data_of(held_system(ligaments)))
    values = []
    for Theta in rng.uniform(-1.4, 1.4, size=(5, 3)):
        at = Taylor(U, tuple((one, one) for one in Theta.tolist()))
        values.append(float(at.value.mid()) - held_energy(ligaments, Theta))
    assert np.ptp(values) < 1e-8


@pytest.mark.parametrize("seed", range(3))
def test_energies_of_a_tied_body_are_those_of_other_formulas(seed):
    rng = np.random.default_rng(seed)
    ligaments = random_ligaments(rng, 2)
    U = Energy(data_of(tied_system(ligaments)))
    values = []
    for Theta in rng.uniform(-1.4, 1.4, size=(4, 3)):
        at = Taylor(U, tuple((one, one) for one in Theta.tolist()))
        values.append(float(at.value.mid()) - least_tied_energy(ligaments, Theta)[0])
        assert at.value.rad() < 1e-9
    assert np.ptp(values) < 1e-6


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32), st.floats(1e-4, 0.3), st.booleans(), st.sampled_from([300.0, 3e5]))
def test_expansions_over_boxes_contain_what_is_inside(seed, radius, held, stiffest):
    rng = np.random.default_rng(seed)
    ligaments = random_ligaments(rng, 2, stiffest)
    U = Energy(data_of((held_system if held else tied_system)(ligaments)))
    centre = rng.uniform(-1.2, 1.2, size=3)
    taylor = Taylor(U, tuple((one - radius, one + radius) for one in centre.tolist()))
    for _ in range(4):
        Theta = centre + rng.uniform(-radius, radius, size=3)
        at = Taylor(U, tuple((one, one) for one in Theta.tolist()))
        assert taylor.values.overlaps(at.value) or not taylor.values.is_finite()
        for i in range(3):
            assert taylor.whole_gradient[i, 0].overlaps(at.gradient[i, 0])
            for j in range(3):
                assert taylor.whole_hessian[i, j].overlaps(at.hessian[i, j])


def test_slopes_and_bounds_at_a_point_agree_with_the_prover():
    """Both follow from the same numbers by other formulas."""
    rng = np.random.default_rng(4)
    ligaments = random_ligaments(rng, 2)
    for system in (held_system(ligaments), tied_system(ligaments)):
        form = reduced_energy(system).form
        U = Energy(energy_of(form).model_dump(mode="json"))
        for Theta in rng.uniform(-1.4, 1.4, size=(4, 3)):
            at = Taylor(U, tuple((one, one) for one in Theta.tolist()))
            _, gradient, hessian = (one[0] for one in form.approximate(Theta[np.newaxis], 2))
            for i in range(3):
                assert float(at.gradient[i, 0].mid()) == pytest.approx(gradient[i], abs=1e-8)
                for j in range(3):
                    found = float(at.hessian[i, j].mid())
                    assert found == pytest.approx(hessian[i, j], abs=1e-6)


WEAK = ligament_of(stiffness=100.0, toe_strain=0.2)
"""Few boxes are needed."""


@pytest.fixture(scope="module")
def proof():
    """Return the proof of a tied body with a ligament."""
    return proof_of(tied_system([WEAK]))


def refused(proof):
    """Return the claims that are refused."""
    with ctx.workprec(128):
        return [finding.claim for finding in check(proof) if not finding.verified]


def test_a_proof_of_a_tied_body_with_a_ligament_is_verified(proof):
    assert proof["proved"]
    assert refused(proof) == []


def test_a_region_that_is_too_high_is_refused(proof):
    changed = copy.deepcopy(proof)
    height = changed["region"]["lower_bound"]
    changed["region"]["energy_bound"] += 1e-3 * height
    assert "certified region" in refused(changed)


def test_a_proof_for_another_ligament_is_refused(proof):
    changed = copy.deepcopy(proof)
    changed["reduced_energy"]["free_ligaments"]["ligaments"][0]["stiffness"] *= 1.5
    assert refused(changed) == ["rest states"]


def test_an_indefinite_spring_of_the_position_is_refused(proof):
    changed = copy.deepcopy(proof)
    changed["reduced_energy"]["free_ligaments"]["stiffness"][0][0] = -1.0
    assert refused(changed) == ["energy"]


def test_small_matrices():
    rng = np.random.default_rng(0)
    A = rng.normal(size=(3, 3))
    definite = (A @ A.T + np.eye(3)).tolist()
    L = cholesky(definite)
    assert np.array(product(L, turned(L))) == pytest.approx(np.array(definite))
    assert np.array(product(inverse(definite), definite)) == pytest.approx(np.eye(3))
    assert inverse([[0.0] * 3 for _ in range(3)]) == [[0.0] * 3 for _ in range(3)]
