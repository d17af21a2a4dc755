"""Protects the checker's evaluation of U: derivatives, Taylor expansion, index and confinement."""

import math
from typing import Any

import numpy as np
import pytest
from flint import arb, arb_mat, ctx
from support.proofs import PROOF, proof_of
from support.rest import system_of

from rbstab.analysis.proof_check.boxes import Box
from rbstab.analysis.proof_check.confinement import confinement
from rbstab.analysis.proof_check.energy import Energy
from rbstab.analysis.proof_check.guards import barrier
from rbstab.analysis.proof_check.rest_states import index_of
from rbstab.analysis.proof_check.taylor import Taylor
from rbstab.analysis.proof_check.trigonometric import rounded


@pytest.fixture(autouse=True)
def _precision() -> Any:
    with ctx.workprec(128):
        yield


@pytest.fixture(scope="module")
def data() -> PROOF:
    energy: PROOF = proof_of(system_of("visco-elastic", 4))["reduced_energy"]
    return energy


def u(data: PROOF, Theta: Any) -> Any:
    """Return U in doubles or longer, term by term."""
    t = []
    for angle in Theta:
        column = [angle * 0 + 1]
        for k in range(1, len(data["coefficients"]) // 2 + 1):
            column += [(k * angle).cos(), (k * angle).sin()]
        t.append(column)
    total = arb(0)
    for i in range(3):
        total += Theta[i] * data["linear"][i]
        for j in range(3):
            total += Theta[i] * Theta[j] * data["quadratic"][i][j] / 2
    for (a, b, c), value in np.ndenumerate(np.array(data["coefficients"])):
        total += t[0][a] * t[1][b] * t[2][c] * float(value)
    return total


def test_derivatives_are_those_of_the_formula(data: PROOF) -> None:
    """Each derivative is compared with a central difference of the one before."""
    U, h = Energy(data), arb(2) ** -20
    Theta = [arb(x) for x in (0.3, -1.1, 2.2)]
    found = U.derivatives(Theta)
    assert len(found) == 1 + 3 + 6 + 10
    assert abs(found[()] - u(data, Theta)) < 1e-10
    for axes in [axes for axes in found if axes]:
        *rest, last = axes
        ahead, behind = ([*Theta] for _ in range(2))
        ahead[last] += h
        behind[last] -= h
        before = tuple(rest)
        slope = U.derivatives(ahead)[before] - U.derivatives(behind)[before]
        assert float((slope / (2 * h) - found[axes]).mid()) == pytest.approx(0.0, abs=2e-8)


def test_a_ball_holds_all_numbers_that_round_to_a_double() -> None:
    for number in (0.1, 1.5, -3.7e100, 0.0, 5e-324, 1.7e308):
        for neighbour in (-math.inf, math.inf):
            beside = math.nextafter(number, neighbour)
            assert rounded(number).contains((arb(number) + arb(beside)) / 2)
            if abs(number) > 1e-300:
                assert not rounded(number).contains(arb(beside))


@pytest.mark.parametrize("face", [None, (0, -1), (1, 1), (2, 1)])
@pytest.mark.parametrize("width", [1e-6, 0.1, 1.5])
def test_the_expansion_holds_in_all_of_a_box(
    data: PROOF, face: tuple[int, int] | None, width: float
) -> None:
    U, rng = Energy(data), np.random.default_rng(3)
    low = rng.uniform(-1.5, 0.0, 3)
    box: Box = tuple((x, x + width) for x in low.tolist())
    flat = None
    if face is not None:
        flat = (face[0], face[1] * arb.pi())
        box = (*box[: face[0]], (0.0, 0.0), *box[face[0] + 1 :])
    taylor = Taylor(U, box, flat)
    least, squares = taylor.values, taylor._by_squares()
    for fractions in [*rng.uniform(size=(20, 3)), *np.ndindex(2, 2, 2)]:
        Theta = [
            arb(a) + (arb(b) - arb(a)) * float(x) for (a, b), x in zip(box, fractions, strict=True)
        ]
        if flat is not None:
            Theta[flat[0]] = flat[1]
        here = U.derivatives(Theta)
        assert least.overlaps(here[()])
        assert not squares > here[()]
        for i in range(3):
            if flat is None:
                assert taylor.whole_gradient[i, 0].overlaps(here[i,])
                for j in range(i, 3):
                    assert taylor.whole_hessian[i, j].overlaps(here[i, j])


def test_the_third_derivatives_count() -> None:
    """U = θ1 - sin θ1 has neither a slope nor a curvature at 0, but U(-1) = sin 1 - 1."""
    coefficients = np.zeros((3, 3, 3))
    coefficients[2, 0, 0] = -1.0
    data = {
        "quadratic": np.zeros((3, 3)).tolist(),
        "linear": [1.0, 0.0, 0.0],
        "coefficients": coefficients.tolist(),
    }
    taylor = Taylor(Energy(data), ((-1.0, 1.0), (0.0, 0.0), (0.0, 0.0)))
    assert taylor.values.contains(arb(1).sin() - 1)
    assert taylor.whole_gradient[0, 0].contains(1 - arb(1).cos())
    assert taylor.whole_hessian[0, 0].contains(-arb(1).sin())


def test_the_lower_bound_is_close_near_a_minimum_on_a_face() -> None:
    """U = ½ (Θ - c)'(Θ - c): completing the square gives the minimum itself."""
    data = {
        "quadratic": [[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 1.0]],
        "linear": [0.0, 0.0, 0.0],
        "coefficients": [[[0.0]]],
    }
    U = Energy(data)
    # On θ3 = π the minimum over θ1 and θ2 is at 0, with U = π²/2.
    taylor = Taylor(U, ((-1.0, 1.2), (-0.9, 1.0), (0.0, 0.0)), (2, arb.pi()))
    least = arb.pi() ** 2 / 2
    assert taylor.stays_above(least - 1e-12)
    assert not taylor.stays_above(least + 1e-12)
    assert not taylor.values >= least - 1e-12


@pytest.mark.parametrize("signs", list(np.ndindex(2, 2, 2)))
def test_the_index_is_the_number_of_negative_eigenvalues(signs: tuple[int, ...]) -> None:
    rng = np.random.default_rng(sum(signs))
    for sizes in ([1.0, 2.0, 3.0], [1.0, 1.0, 1.0], [1.0, 1.0, 2.0], [2.0, 1.0, 1.0], [9, 1, 2]):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        eigenvalues = np.array(sizes) * [1 - 2 * sign for sign in signs]
        H = turn @ np.diag(eigenvalues) @ turn.T
        H = (H + H.T) / 2
        assert index_of(arb_mat([[arb(x, 1e-13) for x in row] for row in H.tolist()])) == sum(signs)


def test_the_index_of_a_singular_matrix_is_not_known() -> None:
    rows = np.diag([1.0, 2.0, 1e-14]).tolist()
    assert index_of(arb_mat([[arb(x, 1e-13) for x in row] for row in rows])) is None


def test_confinement_of_a_known_energy() -> None:
    """U = θ1² + θ1 θ2 / 2 + 2 θ3² + 5 sin θ1 + 3 θ3.

    Its rest states have 2 θ1 = -θ2 / 2 - 5 cos θ1 and 4 θ3 = -3, with |θ2| <= π/2.
    """
    coefficients = np.zeros((3, 3, 3))
    coefficients[2, 0, 0] = 5.0
    data = {
        "quadratic": [[2.0, 0.5, 0.0], [0.5, 0.0, 0.0], [0.0, 0.0, 4.0]],
        "linear": [0.0, 0.0, 3.0],
        "coefficients": coefficients.tolist(),
    }
    found = confinement(Energy(data))
    assert found is not None
    first = (5 + math.pi / 4) / 2
    assert [float(bound) for bound in found] == pytest.approx([first, 0.75], rel=1e-12)
    data["quadratic"] = np.diag([2.0, 0.0, -4.0]).tolist()
    assert confinement(Energy(data)) is None


def guarded(data: PROOF, stiffness: float = 30.0) -> PROOF:
    return {**data, "barrier": stiffness}


def g(angle: Any) -> Any:
    """Return the energy of a barrier with a stiffness of 30 N m."""
    return 15 * (1 / angle.cos() ** 2 - 1)


@pytest.mark.parametrize("angle", [-1.5, -0.4, 0.0, 0.9, 1.55])
def test_derivatives_of_a_barrier_are_those_of_its_energy(angle: float) -> None:
    """Central differences of 1/cos² θ."""
    h = arb(2) ** -30
    value, *rates = barrier(arb(30), arb(angle))
    ahead, here, behind = (g(arb(angle) + step) for step in (h, 0, -h))
    assert value.overlaps(here)
    differences = [(ahead - behind) / (2 * h), (ahead - 2 * here + behind) / (h * h)]
    bent = (g(angle + 2 * h) - g(angle - 2 * h)) / 2 - ahead + behind
    for rate, found in zip(rates, [*differences, bent / h**3], strict=True):
        assert abs(float(rate - found)) <= 1e-5 * abs(float(rate)) + 1e-9


def test_a_barrier_over_an_interval() -> None:
    """Every value inside is in the ball, and there is none where it reaches ±π/2."""
    for low, high in ((-1.2, 1.5), (0.3, 0.4), (-1.5, -1.4)):
        found = barrier(arb(30), arb(low).union(arb(high)))
        for step in range(11):
            angle = arb(low + (high - low) * step / 10)
            assert all(
                ball.contains(inner)
                for ball, inner in zip(found, barrier(arb(30), angle), strict=True)
            )
    assert all(ball.is_nan() for ball in barrier(arb(30), arb(1.5, 0.08)))


def test_taylor_with_a_barrier_contains_all_values(data: PROOF) -> None:
    U = Energy(guarded(data))
    box: Box = ((-0.4, 0.1), (1.2, 1.4), (2.0, 2.2))
    taylor, rng = Taylor(U, box), np.random.default_rng(3)
    for _ in range(50):
        Theta = [arb(rng.uniform(*side)) for side in box]
        here = U.derivatives(Theta)
        assert here[()].overlaps(u(data, Theta) + g(Theta[1]))
        assert taylor.values.contains(here[()])
        for i in range(3):
            assert taylor.whole_gradient[i, 0].contains(here[i,])
            for j in range(i, 3):
                assert taylor.whole_hessian[i, j].contains(here[i, j])


def test_the_slope_of_a_barrier_exceeds_that_of_all_else(data: PROOF) -> None:
    U, smooth = Energy(guarded(data)), Energy(data)
    end = U.end_before(U.barriers[0], arb(5), arb(6))
    assert end is not None
    rng = np.random.default_rng(3)
    for _ in range(100):
        Theta = [arb(rng.uniform(-1, 1) * reach) for reach in (5, math.pi / 2, 6)]
        assert abs(smooth.derivatives(Theta)[1,]) < barrier(arb(30), arb(end))[1]
    weak = Energy(guarded(data, 1e-60))
    assert weak.end_before(weak.barriers[0], arb(5), arb(6)) is None


def test_a_barrier_must_be_stiff(data: PROOF) -> None:
    with pytest.raises(ValueError, match="not positive"):
        Energy(guarded(data, -1.0))
