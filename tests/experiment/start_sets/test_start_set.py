"""The set of the starts within tolerances holds all exact starts, also those at the ends."""

from fractions import Fraction

import numpy as np
import pytest
from flint import arb, ctx, fmpq
from support.polynomial_sets import BITS, value_at
from support.start_sets import VARIANTS, random_config

from rbstab.analysis.exact import decimal_balls
from rbstab.config.build import problem_of, start_of
from rbstab.config.numbers import replaced
from rbstab.config.tolerances import tolerances_of
from rbstab.experiment.convergence.enclosed_system import enclosed_system, state_scale
from rbstab.experiment.start_sets.start_set import start_set_of, whole
from rbstab.proof.boxes import Box


def start_set(config, *texts, part=None):
    tolerances = tolerances_of(config, texts)
    box = whole(len(tolerances)) if part is None else part
    states = start_set_of(config, tolerances, box, state_scale(problem_of(config)))
    assert states is not None
    assert len(states) == 1
    return tolerances, states


def exact_start(config, tolerances, z):
    """Return the start at rational z, in balls, from the config itself."""

    def ball(number):
        return arb(fmpq(number.numerator, number.denominator))

    numbers = {
        path: ball(tolerance.middle + tolerance.radius * x)
        for tolerance, x in zip(tolerances, z, strict=True)
        for path in tolerance.entry.paths
    }

    def convert(values):
        balls = np.empty(values.shape, dtype=object)
        for index, value in enumerate(values.ravel().tolist()):
            balls.flat[index] = (
                value if isinstance(value, arb) else decimal_balls(np.array(value))[()]
            )
        return balls

    system = enclosed_system(config, decimal_balls)
    return start_of(replaced(config, numbers), system, convert)


@pytest.mark.parametrize(
    "texts",
    [
        ("initial.orientation=±0.01", "initial.angular_velocity[1]=±1%"),
        ("initial.orientation[0]=±0.3", "initial.orientation[1]=±1e-9"),
    ],
)
@pytest.mark.parametrize(("variant", "coordinates"), VARIANTS)
def test_exact_starts_are_in_the_set(variant, coordinates, texts):
    """In W, the place of C follows from the orientation. At the ends, and at inner points."""
    if variant != "permanent":
        texts = (*texts, "initial.position[2]=±0.003", "initial.velocity[0]=±0.1")
    config, rng = random_config(variant, coordinates, 11), np.random.default_rng(12)
    tolerances, states = start_set(config, *texts)
    count = len(tolerances)
    assert states.space.variables == count
    points = [[Fraction(x) for x in rng.choice([-1, 1], count).tolist()] for _ in range(4)]
    points += [[Fraction(int(x), 7) for x in rng.integers(-7, 8, count)] for _ in range(2)]
    (polynomial,), (error,) = states.polynomial.tolist(), states.error.tolist()
    worst = np.zeros(len(error))
    for z in points:
        with ctx.workprec(BITS):
            exact = exact_start(config, tolerances, z)
            balls = [arb(fmpq(x.numerator, x.denominator)) for x in z]
            for i, (entry, row) in enumerate(zip(exact, polynomial, strict=True)):
                apart = abs(arb(entry) - value_at(states.space, row, balls))
                assert apart <= arb(error[i])
                worst[i] = max(worst[i], float(apart))
    # Rounding, and in W what the series of the angles leave out.
    assert np.all(states.error <= 1e-14 + (2e-3 if coordinates == "W" else 1e-13))
    assert worst.max() > 0


def test_a_part_has_the_starts_of_its_own_z():
    config, texts = random_config("visco-elastic", "W", 11), ["initial.orientation=±0.01"]
    part = Box(np.array([-1.0, 0.25, -0.5]), np.array([-0.5, 0.5, 1.0]))
    tolerances, states = start_set(config, *texts, part=part)
    for side in (-1, 1):
        z = [Fraction(coordinate) for coordinate in (part.lo if side < 0 else part.hi).tolist()]
        with ctx.workprec(BITS):
            exact, w = exact_start(config, tolerances, z), [arb(side)] * 3
            for i, (entry, row) in enumerate(
                zip(exact, states.polynomial[0].tolist(), strict=True)
            ):
                assert abs(arb(entry) - value_at(states.space, row, w)) <= arb(states.error[0, i])


def test_ends_of_tolerances_are_exact_decimals():
    """0.1 ± 0.2 reaches from -0.1 to 0.3, not from what doubles make of it."""
    initial = {"angular_velocity": [0.1, 0.0, 1.0], "orientation": [0, 0, 0]}
    config = random_config("permanent", "reduced", initial=initial)
    tolerances, states = start_set(config, "initial.angular_velocity[0]=±0.2")
    assert tolerances[0].bounds == ("-0.1", "0.3")
    with ctx.workprec(BITS):
        for z, end in ((-1, fmpq(-1, 10)), (1, fmpq(3, 10))):
            value = value_at(states.space, states.polynomial[0, 3].tolist(), [z])
            assert 0 < abs(value - arb(end)) <= arb(float(states.error[0, 3]))
    assert states.error[0, 3] < 1e-15
    exactly = np.delete(states.polynomial[0], 3, axis=0)
    assert not exactly[:, 1:].any()


def test_starts_without_bounds_are_none():
    def no_set(config, text):
        tolerances = tolerances_of(config, [text])
        scale = state_scale(problem_of(config))
        return start_set_of(config, tolerances, whole(len(tolerances)), scale) is None

    config = random_config("visco-elastic", "W", initial={"orientation": [0, 0, 0]})
    start_set(config, "initial.orientation[0]=±2.5")
    fast = random_config("free", "Z", initial={"angular_velocity": [1e200, 0, 0]})
    assert no_set(fast, "initial.angular_velocity[0]=±1")


@pytest.mark.parametrize("texts", [(), ("body.mass=±1",), ("initial=±0.1", "controller=±1%")])
def test_tolerances_of_other_sections_are_no_start(texts):
    """The equations would not have them."""
    with pytest.raises(ValueError, match="initial state"):
        start_set(random_config("permanent", "reduced"), *texts)
