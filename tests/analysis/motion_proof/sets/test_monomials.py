"""Monomials: products agree with plain dictionaries, and halves are exact substitutions."""

from fractions import Fraction
from math import comb

import numpy as np
import pytest

from rbstab.analysis.motion_proof.sets.monomials import Monomials, monomials_up_to

SHAPES = [(1, 1), (1, 6), (2, 3), (3, 4), (5, 2)]


@pytest.mark.parametrize(("variables", "degree"), SHAPES)
def test_all_monomials_in_order_of_degree(variables, degree):
    space = Monomials(variables, degree)
    everything = np.ndindex(*[degree + 1] * variables)
    assert set(space.exponents) == {one for one in everything if sum(one) <= degree}
    assert len(space) == len(space.exponents) == len(set(space.exponents))
    assert space.degrees.tolist() == sorted(space.degrees.tolist())
    assert [space.exponents[i][i - 1] for i in range(1, variables + 1)] == [1] * variables
    for d, first in enumerate(space.first_of_degree):
        assert space.degrees[first] == d
        assert first == 0 or space.degrees[first - 1] == d - 1


@pytest.mark.parametrize(("variables", "degree"), SHAPES)
def test_lower_degrees_are_the_beginning_of_higher_ones(variables, degree):
    """Models of a lower degree take the first coefficients of those of a higher one."""
    short, long = Monomials(variables, degree), Monomials(variables, degree + 2)
    assert long.exponents[: len(short)] == short.exponents


def test_many_variables_have_few_monomials():
    """They are not sought among all 7¹² products of powers."""
    assert len(Monomials(12, 6)) == comb(18, 6)
    assert len(monomials_up_to(12, 2).exponents) == 91
    assert monomials_up_to(12, 2) is monomials_up_to(12, 2)


@pytest.mark.parametrize(("variables", "degree"), SHAPES)
def test_products_are_those_of_dictionaries(rng, variables, degree):
    space = Monomials(variables, degree)
    a, b = rng.integers(-9, 10, (2, len(space)))
    expected = np.zeros(len(space), dtype=int)
    counts = np.zeros(len(space), dtype=int)
    for i, x in zip(space.exponents, a, strict=True):
        for j, y in zip(space.exponents, b, strict=True):
            place = space.place.get(tuple(np.add(i, j).tolist()))
            if place is not None:
                expected[place] += x * y
                counts[place] += 1
    first, second, begins = space.pairs
    assert np.add.reduceat(a[first] * b[second], begins).tolist() == expected.tolist()
    assert space.most_pairs == counts.max()


@pytest.mark.parametrize(("variables", "degree"), SHAPES)
@pytest.mark.parametrize("side", [-1, 1])
def test_a_half_is_an_exact_substitution(rng, variables, degree, side):
    """The polynomial of the half at z is that of the whole with (z_i + side)/2."""
    space = Monomials(variables, degree)
    coefficients = [Fraction(int(x)) for x in rng.integers(-9, 10, len(space))]
    for variable in range(variables):
        matrix = space.half(variable, side)
        changed = [
            sum((Fraction(x) * c for x, c in zip(row, coefficients, strict=True)), Fraction(0))
            for row in matrix.tolist()
        ]
        z = [Fraction(int(x), 7) for x in rng.integers(-7, 8, variables)]
        moved = list(z)
        moved[variable] = (z[variable] + side) / 2
        assert value(space, changed, z) == value(space, coefficients, moved)


def value(space, coefficients, z):
    total = Fraction(0)
    for exponents, coefficient in zip(space.exponents, coefficients, strict=True):
        term = coefficient
        for power, x in zip(exponents, z, strict=True):
            term *= x**power
        total += term
    return total
