"""Protects the separation of lengths from exact energies, and what it refuses."""

import numpy as np
import pytest

from rbstab.analysis.proof.lines.separate import separated_lines
from rbstab.analysis.proof.multiple_angles import NotTrigonometric, form_of
from rbstab.analysis.proof.polynomial import Ring


def symbols(roots=2):
    """Return a ring, its angles, their sines and cosines."""
    ring = Ring(3, 0, roots=roots)
    Theta = ring.variables()
    sines, cosines = [x.sin() for x in Theta], [x.cos() for x in Theta]
    return ring, Theta, sines, cosines


def test_even_powers_become_squares_and_odd_ones_weights():
    _, Theta, sines, cosines = symbols()
    square, other = 3 + sines[0], 5 - 2 * cosines[1] * sines[2]
    one, two = square.sqrt(), other.sqrt()
    extension = one - 0.25
    energy = Theta[0] * Theta[0] + 4 * extension * extension - 0.5 * two + two * two * sines[1]
    plain, lines = separated_lines(energy)
    assert [line.weight for line in lines] == [-2.0, -0.5]
    expected = Theta[0] * Theta[0] + 4 * square + 0.25 + other * sines[1]
    Q = np.random.default_rng(0).uniform(-1, 1, size=(5, 3))
    np.testing.assert_allclose(form_of(plain).value(Q), form_of(expected).value(Q), rtol=1e-14)
    np.testing.assert_allclose(lines[0].square.value(Q), 3 + np.sin(Q[:, 0]), rtol=1e-14)
    assert [len(line.square.coefficients) for line in lines] == [3, 3]


def test_a_length_that_appears_twice_is_one_line():
    _, _, sines, _ = symbols()
    energy = 2 * (3 + sines[0]).sqrt() + (sines[0] + 3).sqrt()
    assert [line.weight for line in separated_lines(energy)[1]] == [3.0]


def test_terms_that_cancel_leave_no_multiple_of_an_angle():
    """s² + c² = 1: so the distance of two points is linear in the rotation matrix."""
    _, _, (s, *_), (c, *_) = symbols()
    found = separated_lines((4 * s * s + 4 * c * c + s).sqrt())[1][0].square
    assert found.coefficients.shape == (3, 3, 3)
    np.testing.assert_allclose(found.value(np.array([[0.3, 0.0, 0.0]])), 4 + np.sin(0.3))


@pytest.mark.parametrize("case", ["product", "function of Θ", "multiple of an angle"])
def test_what_has_no_bounds_is_refused(case):
    _, _, sines, cosines = symbols(3)
    one, two = (3 + sines[0]).sqrt(), (3 + sines[1]).sqrt()
    energy = {
        "product": one * two,
        "function of Θ": one * cosines[2],
        "multiple of an angle": (3 + sines[0] * cosines[0]).sqrt(),
    }[case]
    with pytest.raises(NotTrigonometric):
        separated_lines(energy)


def test_a_root_without_a_variable_is_unknown():
    ring, Theta, sines, _ = symbols(roots=1)
    assert (3 + sines[0]).sqrt().known
    assert not (3 + sines[1]).sqrt().known
    assert (3 + sines[0]).sqrt().known
    assert not (Theta[0] + 2).sqrt().known
    assert not Ring(3, 0).constant(2).sqrt().known
    assert not (3 + sines[0]).sqrt().sqrt().known
    lengths = Ring(3, 1, roots=1).variables()
    assert not (lengths[3] * lengths[3]).sqrt().known
    assert ring.roots == 1
