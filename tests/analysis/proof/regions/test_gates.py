"""A gate is said to lead to certain minima only if each way down from it is proved."""

from dataclasses import replace

import numpy as np
import pytest
from support.proofs import rest_states
from support.rest import inverted_pendulum

from rbstab.analysis.proof.boxes import RANGE_END, box_around, whole_range
from rbstab.analysis.proof.certified_region import Face
from rbstab.analysis.proof.regions.border_gates import border_gates, minimum_inside
from rbstab.analysis.proof.regions.downhill import Landscape
from rbstab.analysis.proof.regions.gates import (
    Gate,
    falls_along,
    minima_below,
    state_gate,
    undecided_gate,
)
from rbstab.analysis.proof.trigonometric import TrigonometricForm


@pytest.fixture(scope="module")
def pendulum():
    """A pendulum with two valleys and the top between them, and its landscape."""
    rest = rest_states(inverted_pendulum([50.0, 150.0, 70.0], 100.0))
    minima = tuple(point.enclosure for point in rest.states[:2])
    return rest, Landscape(rest.energy.form, minima, RANGE_END)


def place(one):
    """Return Θ of a gate on the border, and its face."""
    assert one.gate.Theta is not None
    assert one.gate.face is not None
    return one.gate.Theta, one.gate.face


def below(landscape, point):
    return minima_below(landscape, point, state_gate(landscape.form, point, 2).lower_bound)


def test_saddle_leads_to_both_sides(pendulum):
    rest, landscape = pendulum
    assert below(landscape, rest.states[2]) == {0, 1}
    gate = state_gate(landscape.form, rest.states[2], 2)
    # Its energy is 0.
    assert -1e-9 < gate.lower_bound <= 0 <= gate.upper_bound < 1e-9
    assert gate.state == 2


def test_one_way_down_is_not_enough_for_a_saddle(pendulum):
    rest, landscape = pendulum
    one = Landscape(landscape.form, landscape.minima[:1], RANGE_END)
    assert below(one, rest.states[2]) is None
    # Of a summit the other ways lead to the same side, as U is low on a connected set about it.
    assert below(one, replace(rest.states[2], index=2)) == {0}


def test_no_index_no_ways(pendulum):
    rest, landscape = pendulum
    assert below(landscape, replace(rest.states[2], index_proved=False)) is None
    assert below(landscape, replace(rest.states[2], index=0)) is None


def test_way_down_must_start_below_the_level(pendulum):
    rest, landscape = pendulum
    top = rest.states[2]
    assert minima_below(landscape, top, -30.0) is None


def test_saddle_in_a_wide_enclosure_has_no_ways(pendulum):
    """Somewhere in the enclosure the saddle may be; only small ones decide."""
    rest, landscape = pendulum
    wide = replace(rest.states[2], enclosure=box_around(np.zeros(3), 0.5))
    assert below(landscape, wide) is None


def test_step_down_must_fall_all_along(pendulum):
    """∂²U/∂θ1² = 50 - 100 cos θ1 at θ2 = 0: negative up to 60°."""
    _, landscape = pendulum
    top = box_around(np.zeros(3), 1e-9)
    for length, falls in ((0.3, True), (0.7, True), (1.2, False), (2.0, False)):
        assert falls_along(landscape.form, top, np.array([length, 0, 0])) is falls
        assert falls_along(landscape.form, top, np.array([-length, 0, 0])) is falls
    assert not falls_along(landscape.form, top, np.array([0, 0.01, 0]))


def test_unknown_gate_leads_everywhere():
    gate = Gate(1.0, 0.9, 1.1, None)
    assert gate.leads_to(0)
    assert gate.leads_to(5)
    assert not replace(gate, ends=frozenset([1])).leads_to(0)
    assert replace(gate, ends=frozenset([1])).leads_to(1)


def test_undecided_boxes_make_one_gate(pendulum):
    _, landscape = pendulum
    assert undecided_gate(landscape.form, whole_range()[:0]) is None
    box = box_around(np.array([1.0, 0.2, 0.3]), 0.01)
    gate = undecided_gate(landscape.form, box)
    assert gate is not None
    U = landscape.form.value(np.random.default_rng(0).uniform(box.low, box.high, size=(500, 3)))
    assert U.min() - 0.1 < gate.lower_bound < U.min()


def test_border_of_the_pendulum_has_one_gate_on_each_side(pendulum):
    _, landscape = pendulum
    found = border_gates(landscape, 60.0)
    assert found is not None
    # At θ1 = ±π: ½ 50 π² - 200 = 46.7 J. At θ2 = ±π/2 U falls outwards or is higher.
    assert [one.gate.face for one in found] == [Face.THETA1_LOW, Face.THETA1_HIGH]
    for one, minimum in zip(found, (1, 0), strict=True):
        sign = -1 if minimum else 1
        leaning = np.sign(landscape.minima[0].centre[0, 0])
        expected = minimum if leaning > 0 else 1 - minimum
        assert one.gate.energy == pytest.approx(25 * np.pi**2 - 200, rel=1e-9)
        assert one.gate.lower_bound <= one.gate.energy <= one.gate.upper_bound
        np.testing.assert_allclose(place(one)[0], [sign * np.pi, 0, 0], atol=1e-6)
        assert minimum_inside(landscape, one) == frozenset([expected])
    assert border_gates(landscape, 40.0) == []


def tilted_bowl(slope):
    """Return U = ½ Σ θ_i² + s θ1, whose minimum is at θ1 = -s."""
    return TrigonometricForm(np.eye(3), np.array([slope, 0.0, 0.0]), np.zeros((1, 1, 1)))


def test_face_at_which_the_energy_falls_outwards_has_no_gate():
    # The minimum lies beyond θ1 = -π, so U falls outwards there.
    form = tilted_bowl(4.0)
    found = border_gates(Landscape(form, (), RANGE_END), np.inf)
    assert found is not None
    assert Face.THETA1_LOW not in {one.gate.face for one in found}
    assert Face.THETA1_HIGH in {one.gate.face for one in found}


def test_every_local_minimum_of_a_bowl_on_a_face_is_a_gate():
    form = tilted_bowl(0.5)
    found = border_gates(Landscape(form, (), RANGE_END), np.inf)
    assert found is not None
    assert sorted(place(one)[1].name for one in found) == sorted(face.name for face in Face)
    for one in found:
        Theta, face = place(one)
        axis, sign = face.value
        expected = np.array([-0.5, 0.0, 0.0])
        expected[axis] = sign * RANGE_END[axis]
        np.testing.assert_allclose(Theta, expected, atol=1e-6)
        assert one.gate.energy == pytest.approx(form.value(expected[None])[0], rel=1e-9)
    levels = [one.gate.lower_bound for one in found]
    assert levels == sorted(levels)


def test_edge_has_no_gate():
    """U falls towards θ3 = π on all other faces, and outwards there."""
    form = TrigonometricForm(np.eye(3), np.array([3.0, 0.0, -30.0]), np.zeros((1, 1, 1)))
    found = border_gates(Landscape(form, (), RANGE_END), np.inf)
    assert found is not None
    # Only the face θ3 = -π, from which U falls inwards, has a lowest point inside its edges.
    (one,) = found
    np.testing.assert_allclose(place(one)[0], [-3.0, 0.0, -np.pi], atol=1e-6)


def test_too_many_boxes_are_an_outcome(monkeypatch, pendulum):
    _, landscape = pendulum
    monkeypatch.setattr("rbstab.analysis.proof.regions.border_gates.BOX_LIMIT", 10)
    assert border_gates(landscape, 60.0) is None
