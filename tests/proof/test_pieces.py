"""Rest states at which a force that jumps, or a stop, holds the body, in closed form.

U = ½ Σ w_i (θ_i - c_i)² with K step(h) h, where h = 0 is a plane or a sphere, or with a stop.
"""

from fractions import Fraction

import numpy as np
import pytest

from rbstab.proof.boxes import Box
from rbstab.proof.enclosures.bounds import BoundedEnergy
from rbstab.proof.exact.expr import expr, variable
from rbstab.proof.model import Energy
from rbstab.proof.pieces import face_at_stop, rest_zeros

V = [variable(k) for k in range(3)]
F = Fraction
HALF = F(1, 2)
CENTRE = (F(3, 10), F(7, 10), F(-1, 5))
NORMAL = (F(3, 5), F(1), F(-1, 2))
END = np.array([2.0, 1.5, 2.0])
BOX = Box(-END, END)
WEIGHTS = [(F(1), F(1), F(1)), (F(2), F(7, 10), F(3)), (F(1), F(1), F(-3))]


def parabola(weights=WEIGHTS[0], centre=CENTRE):
    terms = zip(weights, V, centre, strict=True)
    return sum((HALF * w * (v - c) ** 2 for w, v, c in terms), expr(0))


def plane(offset, normal=NORMAL):
    return sum((n * v for n, v in zip(normal, V, strict=True)), expr(0)) - offset


def proved(U, box=BOX, limit=20_000):
    """Return all zeros: those on surfaces, and the others."""
    with np.errstate(all="ignore"):
        return rest_zeros(Energy(U), BoundedEnergy(U), box, limit)


def as_floats(rows):
    return np.array([[float(x) for x in row] for row in rows])


def encloses(zero, point):
    low, high = zero.enclosure
    return bool(np.all(low <= point + 1e-15) and np.all(point - 1e-15 <= high))


def share_of(couple, offset, weights):
    """Return λ for which Θ = c - λK W⁻¹n is on the plane."""
    load = sum(n * c for n, c in zip(NORMAL, CENTRE, strict=True)) - offset
    return load / (couple * sum(n * n / w for n, w in zip(NORMAL, weights, strict=True)))


def place(share, couple, weights):
    rows = zip(CENTRE, NORMAL, weights, strict=True)
    return np.array([float(c - share * couple * n / w) for c, n, w in rows])


@pytest.mark.parametrize("weights", WEIGHTS)
@pytest.mark.parametrize(
    ("couple", "offset", "ridge", "on"),
    [
        (F(5), HALF, False, True),
        (F(3, 20), HALF, False, False),
        (F(5), F(11, 10), False, False),
        (F(3, 5), HALF, True, True),
        (F(3, 5), F(11, 10), True, False),
    ],
)
def test_a_surface_holds_the_body_where_the_closed_form_is(weights, couple, offset, ridge, on):
    """A plane holds, is too weak, or is not reached; also at a saddle, whose index is exact.

    U falls on both sides of a ridge K min(h, 0): its state has one more negative direction, and
    there is one on each side.
    """
    h, bend = plane(offset), int(weights[2] < 0)
    share = share_of(couple, offset, weights)
    assert (0 < share < 1) == on
    if ridge:
        zeros = proved(parabola(weights) + couple * h - couple * h.step(1) * h)
        places = [F(0)] * (share > 0) + [F(1)] * (share < 1) + [share] * on
    else:
        zeros = proved(parabola(weights) + couple * h.step(1) * h)
        places = [min(max(share, F(0)), F(1))]
    assert zeros.proved
    assert len(zeros.zeros) == len(places)
    for fraction in places:
        point, held = place(fraction, couple, weights), on and fraction == share
        (zero,) = (zero for zero in zeros.zeros if np.abs(zero.point - point).max() < 1e-9)
        assert encloses(zero, point)
        assert (zero.normal is not None) == held
        assert zero.ridge == (held and ridge)
        assert zero.index == bend + zero.ridge
        if held:
            np.testing.assert_allclose(np.cross(zero.normal, as_floats([NORMAL])[0]), 0, atol=1e-12)
            energy = 0.5 * as_floats([weights])[0] @ (point - as_floats([CENTRE])[0]) ** 2
            assert zero.energy == pytest.approx(energy, abs=1e-12)


@pytest.mark.parametrize(("edge", "sign"), [(0, 1), (1, -1)])
def test_where_the_share_is_at_its_ends_nothing_is_claimed(edge, sign):
    """The state is on the plane, and one side of it is at rest too, to first order."""
    couple = F(2, 5)
    centre_side = sum(n * c for n, c in zip(NORMAL, CENTRE, strict=True))
    offset = centre_side - edge * couple * sum(n * n for n in NORMAL)
    h = plane(offset)
    U = parabola() + (0 if sign > 0 else couple * h) + sign * couple * h.step(1) * h
    zeros = proved(U, limit=500)
    assert not zeros.proved
    assert len(zeros.zeros) == int(sign < 0)  # a ridge has another state, away from it
    on = place(F(edge), couple, WEIGHTS[0])
    assert zeros.undecided.touch(Box(on - 1e-6, on + 1e-6)).any()


def test_a_sphere_about_a_hill_has_states_of_each_index():
    """All w_i are negative: two minima, four saddles on the sphere, a maximum at its middle."""
    h = V[0] ** 2 + V[1] ** 2 + V[2] ** 2 - F(1, 4)
    end = np.array([1.0, 1.1, 1.2])
    weights = (F(-1), F(-2), F(-3))
    zeros = proved(parabola(weights, (F(0),) * 3) + 10 * h.step(1) * h, Box(-end, end))
    assert zeros.proved
    held = [zero for zero in zeros.zeros if zero.normal is not None]
    assert (len(zeros.zeros), len(held)) == (7, 6)
    for zero in held:
        axis = int(np.argmax(np.abs(zero.point)))
        np.testing.assert_allclose(np.abs(zero.point), 0.5 * np.eye(3)[axis], atol=1e-12)
        assert zero.index == 2 - axis
    (middle,) = (zero for zero in zeros.zeros if zero.normal is None)
    assert middle.index == 3


@pytest.mark.parametrize("share", [F(1, 5), F(4, 5)])
def test_a_domain_ends_before_the_states_on_both_sides(share):
    """U = -½ θ1² + max(θ1 - λ, 0) + ...: maxima along θ1 on both sides of the held minimum."""
    h = V[0] - share
    zeros = proved(parabola((F(-1), F(1), F(1)), (F(0),) * 3) + h.step(1) * h)
    assert zeros.proved
    places = sorted((float(zero.point[0]), zero.normal is not None) for zero in zeros.zeros)
    np.testing.assert_allclose([x for x, _ in places], [0, float(share), 1], atol=1e-12)
    assert [on for _, on in places] == [False, True, False]


def test_where_two_planes_meet_it_is_not_decided():
    first, second = V[1] - F(2, 5), V[0] - F(1, 10)
    U = parabola() + 5 * first.step(1) * first + 5 * second.step(1) * second
    zeros = proved(U, limit=500)
    assert not zeros.proved
    assert zeros.zeros == ()
    corner = np.array([0.1, 0.4, -0.2])
    assert zeros.undecided.touch(Box(corner, corner)).any()


def test_a_jump_in_energy_that_is_zero_elsewhere_holds_nothing_there():
    """U = ½(θ2² + θ3²) + 0.3 θ1 + step(θ1) θ1 (θ1 + 1): at θ1 = -1 the factor of the step is zero.

    The force does not jump there, and with the slope 0.3 nothing rests. With the slope -0.3 the
    body rests at the surface θ1 = 0.
    """
    x, load = V[0], F(3, 10)
    base = HALF * (V[1] ** 2 + V[2] ** 2) + x.step(1) * x * (x + 1)
    box = Box(np.array([-1.9, -1, -1]), np.array([1.8, 1, 1]))
    nothing, held = proved(base + load * x, box), proved(base - load * x, box)
    assert nothing.proved
    assert held.proved
    assert nothing.zeros == ()
    (zero,) = held.zeros
    np.testing.assert_allclose(zero.point, 0, atol=1e-12)


# -- stops ----------------------------------------------------------------------------------


def at_stop(U, free=()):
    """Return the states at both ends of θ2, ±½."""
    end = np.array([2.0, 0.5, 2.0])
    energy = Energy(U, free=free, stop=HALF)
    return [face_at_stop(energy, Box(-end, end), side).zeros(20_000) for side in (-1, 1)]


LEAN = variable(3)
"""A position; over it, ½ z² - ¼ s z θ2 is least at z = sθ2/4."""


@pytest.mark.parametrize("weights", WEIGHTS)
@pytest.mark.parametrize(("sign", "free"), [(1, True), (-1, True), (1, False)])
def test_a_stop_holds_what_presses_against_it(sign, free, weights):
    """Also where a position is left in the energy: there ∂V/∂θ2 is smaller by θ2/16."""
    U = parabola(weights, (CENTRE[0], sign * F(7, 10), CENTRE[2]))
    U += free * (HALF * LEAN * LEAN - F(1, 4) * sign * LEAN * V[1])
    faces = at_stop(U, (3,) * free)
    pressed, other = faces if sign < 0 else faces[::-1]
    assert pressed.proved
    assert other.proved
    assert other.zeros == ()
    (zero,) = pressed.zeros
    assert encloses(zero, np.array([0.3, sign * 0.5, -0.2]))
    assert zero.index == int(weights[2] < 0)
    np.testing.assert_array_equal(np.abs(zero.normal), [0, 1, 0])


@pytest.mark.parametrize("free", [True, False])
def test_all_states_between_and_at_stops_are_listed(free):
    """A hill in θ2 leans to both ends. With a position, its top is at 0.3/(1 + 1/16)."""
    U = parabola((F(1), F(-1), F(1)), (CENTRE[0], F(3, 10), CENTRE[2]))
    U += free * (HALF * LEAN * LEAN - F(1, 4) * LEAN * V[1])
    energy, end = Energy(U, free=(3,) * free, stop=HALF), np.array([2.0, 0.5, 2.0])
    bounds = BoundedEnergy(U, free=energy.free)
    zeros = rest_zeros(energy, bounds, Box(-end, end), 20_000)
    assert zeros.proved
    listed = sorted((zero.point[1], zero.normal is not None, zero.index) for zero in zeros.zeros)
    top = 0.3 / (1 + free / 16)
    assert listed == [(-0.5, True, 0), (pytest.approx(top, abs=1e-12), False, 1), (0.5, True, 0)]


def test_a_load_that_just_ends_at_a_stop_is_not_decided():
    for pitch in (F(1, 2), F(1, 2) + F(1, 10**17)):
        below, above = at_stop(parabola(centre=(CENTRE[0], pitch, CENTRE[2])))
        assert below.proved
        assert not above.proved
        assert above.zeros == ()
        place_of = np.array([0.3, 0.5, -0.2])
        assert above.undecided.touch(Box(place_of - 1e-6, place_of + 1e-6)).any()


def test_an_enclosure_contains_the_exact_angle_of_a_stop():
    """1/10 is no double: with ∂U/∂θ1 = θ1 + 10⁸ θ2 its place in θ1 is -10⁷ exactly."""
    x, y, z = V
    steep = 10**8
    U = HALF * (x * x + z * z) + steep * x * y - F(10**18) * y + HALF * F(10**17) * y * y
    box = Box(np.array([-1.2e7, -0.1, -1]), np.array([-0.9e7, 0.1, 1]))
    above = face_at_stop(Energy(U, stop=F(1, 10)), box, 1).zeros(20_000)
    (zero,) = above.zeros
    low, high = zero.enclosure
    assert F(low[0]) < -F(10**7) < F(high[0])
    assert F(low[1]) <= F(1, 10) <= F(high[1])
    for end in (low[1], high[1]):
        assert F(low[0]) < -steep * F(end) < F(high[0])
