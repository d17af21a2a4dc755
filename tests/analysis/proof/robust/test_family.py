"""The bounds of a family hold for each body in its box; a single number attains them."""

from fractions import Fraction

import numpy as np
import pytest
from flint import arb, ctx
from support.bodies import box_of, config_of, member, some_bodies

from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.least_value import lower_bounds
from rbstab.analysis.proof.reduced_energy import reduced_energy
from rbstab.analysis.proof.robust.elimination import eliminated_for_all, series_of_reciprocal
from rbstab.analysis.proof.robust.energies import energies_of, relevant, stored_energy
from rbstab.analysis.proof.robust.expansion import chebyshev
from rbstab.analysis.proof.robust.family import FormFamily
from rbstab.analysis.proof.robust.numbers import BodiesRing, Part
from rbstab.analysis.proof.trigonometric import TrigonometricForm

FULL = {
    "K_t": [[4100, 600, 0], [600, 4100, -300], [0, -300, 3280]],
    "K_r": [[400, 50, 20], [50, 400, 0], [20, 0, 320]],
}
HEAVY = [1.0, -2.0, -9.81]

BOXES = [
    ("permanent", {}, ["controller.K_r[0]=±30%"]),
    ("permanent", {}, ["controller.K_t[1]=±30%"]),
    ("permanent", {}, ["body.contact_point[2]=±0.05"]),
    ("permanent", {}, ["controller=±20%", "body.contact_point=±0.02"]),
    ("permanent", {"gravity": HEAVY}, ["body.mass=±10%", "gravity=±0.5"]),
    ("permanent", {"controller": FULL}, ["controller=±10%"]),
    (
        "permanent",
        {"gravity": HEAVY, "controller": {"anchor": "equilibrium"}},
        ["controller.K_t=±5%"],
    ),
    ("free", {"gravity": HEAVY}, ["controller=±10%", "body.mass=±10%"]),
    ("visco-elastic", {}, ["controller.K_c[0]=±30%"]),
    ("visco-elastic", {"gravity": HEAVY}, ["controller=±20%", "body.contact_point=±0.02"]),
    ("visco-elastic", {"controller": FULL}, ["controller.K_c=±10%", "controller.K_t=±5%"]),
    ("embedded", {}, ["controller=±20%"]),
    ("embedded", {"gravity": HEAVY}, ["controller.K_d[1]=±40%", "body.contact_point=±0.02"]),
]


def points(rng, count=40):
    return rng.uniform(-1, 1, size=(count, 3)) * [3.1, 1.5, 3.1]


@pytest.mark.parametrize(("variant", "sections", "texts"), BOXES)
def test_each_body_is_within_the_bounds(variant, sections, texts):
    """The energies of single bodies come from another program: one without z."""
    rng = np.random.default_rng(1)
    members, part = box_of(config_of(variant, **sections), *texts)
    family = energies_of(members, part).family
    Theta, reference = points(rng), np.array([0.1, -0.2, 0.3])
    bounds = family.above(reference).rigorous(Theta, 3)
    largest = 0.0
    for numbers in some_bodies(part, rng, 12):
        form = reduced_energy(member(members, numbers)).form
        values = form.approximate(Theta, 3)
        values[0] = values[0] - form.value(reference[np.newaxis])
        for level, (value, bound) in enumerate(zip(values, bounds, strict=True)):
            apart = np.abs(value - bound.values)
            slack = 1e-9 * np.abs(value).max()
            assert np.all(apart <= bound.error + slack), level
            largest = max(largest, float((apart / (bound.error + slack)).max()))
    # The bounds are not far too wide: some body comes near them.
    assert largest > 0.3


ALONE = [
    ("permanent", "controller.K_r[0]=±30%", 0.999),
    ("permanent", "controller.K_t[1]=±30%", 0.999),
    ("permanent", "body.contact_point[2]=±0.01", 0.95),
    ("free", "controller.K_r[2]=±30%", 0.999),
    ("visco-elastic", "controller.K_c[0]=±10%", 0.9),
    ("embedded", "controller.K_d[0]=±10%", 0.9),
]


@pytest.mark.parametrize(("variant", "text", "share"), ALONE)
def test_a_single_number_attains_the_bounds(variant, text, share):
    """So no term of U may be missing, and none may be counted twice."""
    members, part = box_of(config_of(variant), text)
    family = energies_of(members, part).family
    Theta = points(np.random.default_rng(2), 1)
    bound = family.rigorous(Theta, 1)[1]
    ends = [
        reduced_energy(member(members, (part.middle[0] + sign * part.radius[0],))).form
        for sign in (-1, 1)
    ]
    gradients = [form.approximate(Theta, 1)[1] for form in ends]
    width = np.abs(gradients[1] - gradients[0]) / 2
    seen = bound.error > 1e-6
    assert np.any(seen)
    assert np.all(width[seen] >= share * bound.error[seen])
    assert np.all(width <= bound.error * (1 + 1e-9) + 1e-9)


@pytest.mark.parametrize(("variant", "sections", "texts"), BOXES[3:10])
def test_bounds_over_boxes_hold_for_each_body(variant, sections, texts):
    rng = np.random.default_rng(3)
    members, part = box_of(config_of(variant, **sections), *texts)
    family = energies_of(members, part).family.above(np.zeros(3))
    centre = points(rng, 20)
    radius = 10.0 ** rng.uniform(-4, -0.5, size=(20, 1)) * np.ones(3)
    boxes = Boxes(centre - radius, centre + radius)
    enclosed = enclosure(family, boxes)
    lower, curvature = lower_bounds(enclosed), enclosed.curvature
    for numbers in some_bodies(part, rng, 6):
        form = reduced_energy(member(members, numbers)).form
        delta = rng.uniform(-1, 1, size=(20, 3)) * radius
        value, gradient = form.approximate(centre + delta, 1)
        assert np.all(value - form.value(np.zeros((1, 3))) >= lower - 1e-8)
        linear = enclosed.gradient + np.einsum("mij,mj->mi", enclosed.hessian, delta)
        assert np.all(np.abs(gradient - linear) <= curvature + 1e-8)


def test_errors_of_rounding_are_counted():
    """The exact values are computed in balls of 400 bits."""
    rng = np.random.default_rng(4)
    forms = []
    for size in (1e8, 1.0, 1e-3):
        coefficients = size * rng.normal(size=(5, 5, 5))
        # Large terms that nearly cancel leave mostly rounding errors.
        coefficients[1:] = -coefficients[:1] * np.array([1, -1, 1, -1])[:, None, None]
        Q = size * rng.normal(size=(3, 3))
        forms.append(TrigonometricForm(Q + Q.T, size * rng.normal(size=3), coefficients))
    first, *others = forms
    family = FormFamily(first.quadratic, first.linear, first.coefficients, others=tuple(others))
    Theta = points(rng, 20)
    computed, error = family.gradients(Theta)
    computed_hessian = family.hessians(Theta[0])
    worst = 0.0
    for m, point in enumerate(Theta):
        for f, form in enumerate(forms):
            for axis in range(3):
                exact = exact_derivative(form, point, (axis,))
                wrong = abs(float(arb(computed[m, f, axis]) - exact))
                assert wrong <= family.errors[1][f, axis]
                worst = max(worst, wrong / family.errors[1][f, axis])
    assert worst > 1e-3  # rounding errors occur, and the bounds are not absurd
    assert np.all(error >= family.errors[1].sum(axis=0))
    for f, form in enumerate(forms):
        for i, j in np.ndindex(3, 3):
            exact = exact_derivative(form, Theta[0], (i, j))
            assert abs(float(arb(computed_hessian[f, i, j]) - exact)) <= family.errors[2][f, i, j]


def exact_derivative(form, Theta, axes):
    """Return a derivative of a form as a ball, term by term."""
    with ctx.workprec(400):
        t = []
        for axis in range(3):
            angle, order = arb(float(Theta[axis])), axes.count(axis)
            row = [arb(1 if order == 0 else 0)]
            for k in range(1, 3):
                sine, cosine = (k * angle).sin_cos()
                turn = [cosine, -sine, -cosine, sine]
                row += [k**order * turn[order % 4], k**order * turn[(order + 3) % 4]]
            t.append(row)
        total = arb(0)
        for a, b, c in np.ndindex(5, 5, 5):
            total += arb(float(form.coefficients[a, b, c])) * t[0][a] * t[1][b] * t[2][c]
        rates = [arb(float(x)) for x in form.linear]
        if len(axes) == 2:
            return total + arb(float(form.quadratic[axes]))
        (i,) = axes
        for j in range(3):
            total += arb(float(form.quadratic[i, j])) * arb(float(Theta[j]))
        return total + rates[i]


def test_only_numbers_that_matter_are_varied():
    """Without weight, mass has no effect on U; inertia and damping never have."""
    texts = ["controller=±10%", "body=±10%"]
    for gravity, mass in (([0, 0, 0], 0), (HEAVY, Fraction("4.1"))):
        members, part = box_of(config_of("permanent", gravity=gravity), *texts)
        left = relevant(members, part)
        kept = [bool(radius) for radius in left.radius]
        # K_t, L_t, K_r, L_r, then mass, inertia and contact point.
        assert kept[:12] == [True] * 3 + [False] * 3 + [True] * 3 + [False] * 3
        assert left.radius[12] == mass
        assert kept[13:] == [False] * 3 + [True] * 3


@pytest.mark.parametrize("power", range(7))
def test_powers_in_chebyshev_polynomials(power):
    z = np.linspace(-1, 1, 11)
    terms = chebyshev(power).items()
    total = sum(float(weight) * np.cos(degree * np.arccos(z)) for degree, weight in terms)
    np.testing.assert_allclose(total, z**power, atol=1e-14)


@pytest.mark.parametrize(
    "delta", [Fraction(1, 100), Fraction(1, 4), Fraction(2, 3), Fraction(9, 10)]
)
def test_error_of_the_series_is_attained(delta):
    weights, error = series_of_reciprocal(delta)
    t = np.linspace(-float(delta), float(delta), 2001)
    series = sum(float(x.p) / float(x.q) * t**k for k, x in enumerate(weights))
    assert np.abs(1 / (1 + t) - series).max() == pytest.approx(float(error), rel=1e-6)


def test_no_width_is_a_single_body():
    members, part = box_of(config_of("embedded"), "controller=±20%")
    family = energies_of(members, part.centre).family
    single = reduced_energy(member(members, part.middle)).form
    assert family.others == ()
    np.testing.assert_allclose(family.coefficients, single.coefficients, rtol=1e-12, atol=1e-9)


SERIES = [
    ("visco-elastic", {}, ["controller.K_c[0]=±30%"], 0.9),
    (
        "visco-elastic",
        {"gravity": HEAVY},
        ["controller.K_c[1]=±30%", "controller.K_t[1]=±30%"],
        0.3,
    ),
    ("embedded", {}, ["controller.K_d[2]=±40%"], 0.1),
    ("embedded", {"controller": FULL}, ["controller.K_t=±10%"], 0.001),
]


@pytest.mark.parametrize(("variant", "sections", "texts", "share"), SERIES)
def test_the_series_is_off_by_no_more_than_its_remainders(variant, sections, texts, share):
    """Where a single number decides, the series comes near its bound."""
    rng = np.random.default_rng(9)
    members, part = box_of(config_of(variant, **sections), *texts)
    ring, energy = stored_energy(members, part)
    reduced = eliminated_for_all(energy)
    Theta, largest = points(rng, 5), 0.0
    for z in [*np.linspace(-1, 1, 21), *rng.uniform(-1, 1, size=20)]:
        places = np.full(ring.parameters, z)
        if len(part.middle) > 1:
            places = places * rng.choice([-1.0, 1.0], size=ring.parameters)
        numbers = [
            middle + radius * Fraction(float(w))
            for middle, radius, w in zip(
                part.middle, part.radius, places[: len(part.middle)], strict=True
            )
        ]
        exact = reduced_energy(member(members, numbers)).form.value(Theta)
        series = value_of(reduced.energy, Theta, places)
        allowed = sum(
            float(one.size) * np.abs(value_of(one.polynomial, Theta, places))
            for one in reduced.remainders
        )
        apart = np.abs(exact - series)
        assert np.all(apart <= allowed + 1e-9)
        largest = max(largest, float((apart / allowed).max()))
    assert largest >= share


def value_of(polynomial, Theta, z):
    """Return a polynomial without lengths at some points, for one z."""
    total = np.zeros(len(Theta))
    for powers, coefficient in polynomial.terms():
        angles, sines, cosines, _, parameters, _ = polynomial.ring.split(powers)
        waves = Theta**angles * np.sin(Theta) ** sines * np.cos(Theta) ** cosines
        weight = np.prod(z ** np.array(parameters)) * float(coefficient.p) / float(coefficient.q)
        total = total + weight * np.prod(waves, axis=1)
    return total


def test_each_pair_of_lengths_has_its_remainder():
    """½ R_ii b_i² and R_ij b_i b_j, with |R_ij| <= ε √(S_ii S_jj): the product counts twice."""
    members, part = box_of(config_of("embedded"), "controller.K_d[2]=±40%")
    sizes = [
        float(one.size) for one in eliminated_for_all(stored_energy(members, part)[1]).remainders
    ]
    # Only the third axis has a tolerance: X_3 with itself, with D_3, and D_3 with itself.
    assert len(sizes) == 3
    assert sizes[1] ** 2 / (sizes[0] * sizes[2]) == pytest.approx(4, rel=1e-9)
    H = np.array([[3280.0 + 9840.0, -9840.0], [-9840.0, 2 * 9840.0]])
    S = np.linalg.inv(H)
    assert sizes[0] / sizes[2] == pytest.approx(S[0, 0] / S[1, 1], rel=1e-9)


def test_fourth_derivatives_of_all_forms_count():
    """U = w sin θ1: its third derivative -w cos θ1 is zero at π/2, but not in a box around it."""
    none, sine = np.zeros((3, 3, 3)), np.zeros((3, 3, 3))
    sine[2, 0, 0] = 1.0
    wave = TrigonometricForm(np.zeros((3, 3)), np.zeros(3), sine)
    family = FormFamily(np.zeros((3, 3)), np.zeros(3), none, others=(wave,))
    centre, radius = np.array([[np.pi / 2, 0.0, 0.0]]), 0.3
    bounds = enclosure(family, Boxes(centre - radius, centre + radius))
    assert bounds.third[0, 0, 0, 0] >= np.sin(0.3)
    assert bounds.third[0, 1, 1, 1] < 1e-12


def test_reciprocal_has_its_remainder():
    """1/(1 + 0.8 z): at z = -1 the series is off by all of its remainder."""
    ring = BodiesRing(0, Part((Fraction(1),), (Fraction("0.8"),)))
    reciprocal = 1 / ring.numbers[0]
    nowhere = np.zeros((1, 3))

    def at(z, w):
        return value_of(reciprocal, nowhere, np.array([z, w, 0.0, 0.0, 0.0]))[0]

    z = np.linspace(-1, 1, 41)
    apart = [abs(1 / (1 + 0.8 * one) - at(one, 0)) for one in z]
    remainder = at(0.0, 1.0) - at(0.0, 0.0)
    assert max(apart) <= remainder * (1 + 1e-12)
    assert apart[0] == pytest.approx(remainder, rel=1e-12)
    # The same divisor has the same unknown w; a divisor with a zero has no reciprocal.
    assert (2 / ring.numbers[0] - 2 * reciprocal).constant_value == 0
    assert not (1 / (ring.numbers[0] - Fraction("0.5"))).known
