"""Protects the bound on the slope of the periodic part, from which all rest states are bounded."""

import numpy as np
import pytest
from support.held_springs import held_system, random_springs

from rbstab.analysis.proof import unwrapped
from rbstab.analysis.proof.boxes import RANGE_END
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.lines import slopes
from rbstab.analysis.proof.lines.slopes import FACTOR, steepest_periodic
from rbstab.analysis.proof.reduced_energy import reduced_energy
from rbstab.analysis.proof.unwrapped import unwrapped_end


@pytest.mark.parametrize("axis", [0, 2])
def test_the_bound_is_above_all_slopes_but_not_by_much(axis):
    springs = random_springs(np.random.default_rng(3), 2)
    form = reduced_energy(held_system(springs)).form
    (bound,) = steepest_periodic(form, [axis])
    Theta = np.random.default_rng(0).uniform(-1, 1, size=(40_000, 3)) * RANGE_END
    slope = form.approximate(Theta, 1)[1] - Theta @ form.quadratic - form.linear
    most = np.abs(slope[:, axis]).max()
    assert most <= bound <= 1.1 * FACTOR * most
    # The bounds of single terms are much larger.
    assert bound < 0.8 * form.steepest[axis]


def test_a_bound_that_is_enough_takes_fewer_boxes_and_holds(monkeypatch):
    springs = random_springs(np.random.default_rng(3), 2)
    form = reduced_energy(held_system(springs)).form
    close, boxes = float(steepest_periodic(form, [0])[0]), []

    def counted(form, pending):
        boxes.append(len(pending))
        return enclosure(form, pending)

    monkeypatch.setattr(slopes, "enclosure", counted)
    assert steepest_periodic(form, [0]) == close
    first, boxes[:] = sum(boxes), []
    (wide,) = steepest_periodic(form, [0], enough=2.0 * close)
    assert close < wide <= 2.0 * close * (1 + 1e-9)
    assert sum(boxes) < 0.7 * first
    assert steepest_periodic(form, [0], enough=0.5 * close)[0] == pytest.approx(close, rel=0.1)


def test_several_axes_have_the_bounds_of_each_in_fewer_boxes(monkeypatch):
    springs = random_springs(np.random.default_rng(3), 2)
    form = reduced_energy(held_system(springs)).form
    examined = []

    def counted(form, pending):
        examined.append(len(pending))
        return enclosure(form, pending)

    monkeypatch.setattr(slopes, "enclosure", counted)
    alone, boxes = [], []
    for axis in range(3):
        examined.clear()
        alone.append(float(steepest_periodic(form, [axis])[0]))
        boxes.append(sum(examined))
    examined.clear()
    together = steepest_periodic(form, (0, 1, 2))
    # Centres of boxes that one axis alone does not need may show a steeper slope.
    assert np.all(together >= np.array(alone) * (1 - 1e-12))
    np.testing.assert_allclose(together, alone, rtol=0.05)
    assert sum(examined) < 0.8 * sum(boxes)
    # An axis whose boxes are done has its bound although others are not.
    first = int(np.argmin(boxes))
    monkeypatch.setattr(slopes, "BOX_LIMIT", boxes[first] + 1)
    limited = steepest_periodic(form, (first, int(np.argmax(boxes))))
    assert limited[1] == form.steepest[int(np.argmax(boxes))]


def test_the_ends_are_those_of_the_closest_bounds(monkeypatch):
    for seed, scale in ((3, 3.0), (4, 12.0), (5, 1.5)):
        form = reduced_energy(
            held_system(random_springs(np.random.default_rng(seed), 1), scale)
        ).form
        found = unwrapped_end(form)
        with monkeypatch.context() as patched:
            patched.setattr(unwrapped, "ENOUGH", 0.0)
            expected = unwrapped_end(form)
        assert found is not None
        assert expected is not None
        np.testing.assert_allclose(found, expected, rtol=0.02)


@pytest.mark.heavy
def test_the_end_follows_from_the_sharper_bound():
    springs = random_springs(np.random.default_rng(3), 2)
    form = reduced_energy(held_system(springs, 3.0)).form
    end = unwrapped_end(form)
    assert end is not None
    loads = steepest_periodic(form, (0, 2))
    stiffness = form.quadratic[np.ix_([0, 2], [0, 2])]
    np.testing.assert_allclose(np.diag(stiffness), [1200.0, 960.0])
    assert np.all(end[[0, 2]] >= loads / np.diag(stiffness))
    assert np.all(end[[0, 2]] < form.steepest[[0, 2]] / np.diag(stiffness) + 6)
