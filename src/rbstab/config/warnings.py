"""Warnings about configs that are valid and most likely not meant: one function for each.

Most are about units. The body itself tells which sizes are likely: its density, and its radius of
gyration √(J/m).
"""

import math
from collections.abc import Callable, Iterator

import numpy as np

from rbstab.config.build import problem_of, system_of
from rbstab.config.controllers import Implicit
from rbstab.config.numbers import keys_of, unit_at, unit_problem
from rbstab.config.schema import Config
from rbstab.config.sections.angles import NumberInDegrees
from rbstab.config.units import NumberKey, number_key
from rbstab.config.user_code.permission import without_code
from rbstab.mechanics.body import triangle_violation

FAR_ANCHOR = 10.0
"""m: no body of this program sags so far on springs K_t that shall carry it."""

FAR = 100.0
"""A length of so many radii of gyration of the body is most likely one in mm."""

HEAVIEST = 22_600.0
"""The density of osmium, kg/m³. No body is denser."""

LIGHTEST = 0.05
"""A body of a lower density, kg/m³, is most likely one whose inertia has another unit. Air has 1.2,
thin rods some 1."""

BALL = 16.6
"""The volume of a ball is this times the cube of its radius of gyration √(2/5) r."""

INERTIA_UNITS = {"g m²": 1e3, "kg cm²": 1e4, "kg mm²": 1e6, "g mm²": 1e9}
"""How many of some units are 1 kg m²."""

LARGEST_STRAIN = 0.3
"""Ligaments tear at less; a larger strain is most likely one in %."""

STRONGEST_GRAVITY = 100.0
"""m/s². That of Jupiter is 25; a stronger one is most likely in mm/s²."""

FASTEST = 180.0
"""A faster rate, rad/s (29 turns a second), is most likely one in degrees per second."""

WIDEST = 1.0
"""A larger tilt, rad (57°), with which a body counts as returned, is most likely one in degrees."""


def config_warnings(config: Config) -> list[str]:
    """Return warnings about a config. A config with warnings can still be run."""
    with np.errstate(all="ignore"):
        return [sentence for check in _CHECKS for sentence in check(config)]


def _triangle(config: Config) -> Iterator[str]:
    moments = triangle_violation(_inertia(config))
    if moments is not None:
        large, middle, small = moments
        yield (
            f"body.inertia: no real body has the principal moments {large:g}, {middle:g}, {small:g}"
            f" kg m²: {large:g} > {middle:g} + {small:g} breaks the triangle inequality"
        )


def _density(config: Config) -> Iterator[str]:
    gyration = _gyration(config)
    density = config.body.mass / (BALL * gyration**3)
    if density > HEAVIEST:
        yield (
            f"body.mass: a ball with this mass and inertia has {density:.2g} kg/m³, and no metal "
            f"has more than {HEAVIEST:g}; is the mass in kg (not g), the inertia in kg m²?"
        )
    extent = max(math.hypot(*point) for point in _body_points(config))
    if density < LIGHTEST and 0 < extent < gyration / 10:
        ratio = 2 * math.log10(gyration / extent)
        unit = min(INERTIA_UNITS, key=lambda name: abs(math.log10(INERTIA_UNITS[name]) - ratio))
        yield (
            f"body.inertia: a ball with this mass and inertia has {density:.2g} kg/m³ and a radius "
            f"of gyration of {gyration:.2g} m, but its points lie within {extent:.2g} m; is the "
            f"inertia in kg m² (not {unit}), the mass in kg?"
        )


def _lengths(config: Config) -> Iterator[str]:
    gyration = _gyration(config)
    sizes = {key: math.hypot(*numbers) for key, numbers in _numbers(config, "m")}
    far = {key: size for key, size in sizes.items() if size > FAR * gyration}
    if far:
        yield (
            f"{', '.join(far)}: up to {max(far.values()):.4g} m, for a body with a radius of "
            f"gyration of {gyration:.2g} m; are lengths in m (not mm)?"
        )


def _strains(config: Config) -> Iterator[str]:
    for key, (number, *_) in _numbers(config, "1"):
        if key.endswith("strain") and number > LARGEST_STRAIN:
            yield f"{key}: {number:g} is {100 * number:g} %; 3 % is 0.03"


def _gravity(config: Config) -> Iterator[str]:
    if config.gravity[2] > 0:
        yield f"gravity: it points up, for z points up; down is [0, 0, {-config.gravity[2]:g}]"
    size = math.hypot(*config.gravity)
    if size > STRONGEST_GRAVITY:
        yield f"gravity: {size:g} m/s²; is it in m/s² (not mm/s²)?"


def _angles(config: Config) -> Iterator[str]:
    for unit, largest in (("rad", 2 * math.pi), ("rad/s", FASTEST)):
        for key, numbers in _numbers(config, unit):
            size, read = max(map(abs, numbers)), number_key(key) or NumberKey(())
            if size > largest and unit_problem(config, read) is None:
                turns = f"{size / (2 * math.pi):.3g} turns" + " a second" * (unit == "rad/s")
                degrees = "[...]" if len(numbers) > 1 else f"{numbers[0]:g}"
                yield f"{key}: {size:g} {unit} is {turns}; in degrees: {{deg: {degrees}}}"
    within = 0.0 if config.desired is None else config.desired.within
    if within >= WIDEST and not isinstance(within, NumberInDegrees):
        angle = f"{within:g} rad is {math.degrees(within):.4g}°"
        yield f"desired.within: {angle}; in degrees: {{deg: {within:g}}}"


def _far_anchor(config: Config) -> Iterator[str]:
    if getattr(config.controller, "anchor", "origin") != "equilibrium":
        return
    X_a = system_of(without_code(config)).anchor
    if float(np.linalg.norm(X_a)) > FAR_ANCHOR:
        position = ", ".join(f"{coordinate:.3g}" for coordinate in X_a)
        yield (
            f"controller.anchor: `equilibrium` is where K_t alone carries the weight, X = "
            f"({position}) m; if the contact point carries it, take `origin`"
        )


def _implicit_steps(config: Config) -> Iterator[str]:
    law = getattr(config.controller, "law", None)
    if not isinstance(law, Implicit):
        return
    spacing = config.integration.duration / (config.integration.samples - 1)
    if law.implicit > spacing:
        yield (
            f"controller.law: implicit steps of {law.implicit:g} s are longer than the time "
            f"between samples; steps of {spacing:g} s are used"
        )
    yield (
        f"controller.law: implicit steps of {law.implicit:g} s damp the motion numerically; "
        "on s = E they remove discarded_energy and change when an axis sticks"
    )


def _motion(config: Config) -> Iterator[str]:
    # Imported late: it needs the equations of motion.
    from rbstab.analysis.start_warnings import start_warnings

    yield from start_warnings(problem_of(without_code(config)), config.integration.engine)


_CHECKS: tuple[Callable[[Config], Iterator[str]], ...] = (
    _triangle,
    _density,
    _lengths,
    _strains,
    _gravity,
    _angles,
    _far_anchor,
    _implicit_steps,
    _motion,
)


def _inertia(config: Config) -> np.ndarray:
    array = np.array(config.body.inertia)
    return np.diag(array) if array.ndim == 1 else array


def _gyration(config: Config) -> np.float64:
    """Return the largest radius of gyration, m: powers of this number overflow without an error."""
    return np.sqrt(np.float64(np.linalg.norm(_inertia(config), 2)) / config.body.mass)


def _body_points(config: Config) -> list[tuple[float, ...]]:
    """Return the contact point and the points of elements, body coordinates."""
    points = (getattr(section, "point", None) for section in config.elements.values())
    return [config.body.contact_point, *(point for point in points if point is not None)]


def _numbers(config: Config, unit: str) -> Iterator[tuple[str, list[float]]]:
    """Yield the keys with a unit, and the numbers of each."""
    for key, numbers in keys_of(config).items():
        if unit_at(config, key) == unit:
            yield key, numbers
