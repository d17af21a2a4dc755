"""Protects the least length of a line: where it may be zero, nothing is proved."""

from dataclasses import replace

import numpy as np
import pytest
from support.held_springs import R, held_system, random_springs

from rbstab.analysis.proof.lines.line import Line
from rbstab.analysis.proof.lines.shortest import FRACTION
from rbstab.analysis.proof.reduced_energy import (
    NoEnergyReason,
    NoReducedEnergy,
    reduced_energy,
)


@pytest.mark.parametrize("seed", range(8))
def test_the_bound_is_below_the_least_square_but_not_by_much(seed):
    """The least length is the difference of the distances of both ends from the contact point."""
    (spring,) = random_springs(np.random.default_rng(seed), 1)
    (line,) = reduced_energy(held_system([spring])).form.lines
    assert isinstance(line, Line)
    sides = np.linalg.norm(R - spring.anchor), np.linalg.norm(spring.point - R)
    least = (sides[0] - sides[1]) ** 2
    assert 0 < line.least <= least * (1 + 1e-12)
    assert line.least >= 0.9 * FRACTION * least


@pytest.mark.parametrize("rest_length", [0.2, 0.0])
def test_a_line_that_may_have_no_length_is_refused(rest_length):
    """Both ends are at the same distance from the contact point; a rest length of 0 is no excuse.

    Without a rest length the energy is smooth, but the force of the damper has no direction.
    """
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    (spring,) = random_springs(np.random.default_rng(0), 1)
    touching = replace(spring, anchor=R + turned @ (spring.point - R), rest_length=rest_length)
    with pytest.raises(NoReducedEnergy) as error:
        reduced_energy(held_system([touching]))
    assert error.value.reason is NoEnergyReason.NO_LENGTH
    apart = replace(touching, anchor=R + 1.1 * turned @ (spring.point - R))
    (line,) = reduced_energy(held_system([apart])).form.lines
    assert isinstance(line, Line)
    assert line.least > 0
    assert (line.weight == 0) == (rest_length == 0)
