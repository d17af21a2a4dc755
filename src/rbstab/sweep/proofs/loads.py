"""How large the disturbances of members become: the loads of their inputs, many members at once.

The loads a_i s_i(t) d_i of one kind, with |s_i| <= S_i and unit vectors d_i, add up to at most
√(A'|G|A), A_i = |a_i| S_i and G_ij = d_i'd_j. The directions of two frames may have any angle: then
G_ij is 1.
"""

import math
from functools import reduce
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.bounded import Bounded, bounded_decimal
from rbstab.config.numbers import replaced
from rbstab.config.schema import Config
from rbstab.config.sections.signals import extremes
from rbstab.config.source import Path
from rbstab.elements.inputs.loads import Input
from rbstab.elements.registry import element_of
from rbstab.mechanics.numbers import Array, sqrt
from rbstab.proof.disturbed.forms import Load
from rbstab.proof.disturbed.record import Stated
from rbstab.sweep.plan.axes import varied_numbers
from rbstab.sweep.plan.plan import Plan


class Disturbances(NamedTuple):
    """The disturbances of m members.

    Attributes:
        largest: The largest load of each kind that the plan bounds, shape (m,), N m or N; infinite
            where a signal has no largest value.
        below: Whether all loads stay at or below the bounds, rigorously, shape (m,).
        other: Whether another load acts: of another kind, or a force at another point.
    """

    largest: dict[str, Array]
    below: Array
    other: Array


class _Part(NamedTuple):
    """An input of members: its frame, |a|, S, and its direction, shape (3,)."""

    frame: str
    amplitude: Any
    extent: Any
    direction: Array


def is_of_input(config: Config, path: Path) -> bool:
    """Return whether a number is one of an input."""
    return path[0] == "elements" and path[1] in _inputs(config)


def _inputs(config: Config) -> list[str]:
    """Return the names of the inputs of a config."""
    sections = config.elements.items()
    return [n for n, s in sections if s.kind == "input" and issubclass(element_of(s), Input)]


@np.errstate(all="ignore")  # what has no largest value is not below a bound
def disturbances(plan: Plan, stated: Stated) -> Disturbances:
    """Return the disturbances of the members of a plan, whose variants have the same inputs.

    Args:
        plan: The plan.
        stated: The bounds that it states.
    """
    base, members = next(iter(plan.bases.values())), plan.members
    keys = [k for k in plan.varied_keys if is_of_input(base, k.path)]
    values = plan.values(0, members, [k.key for k in keys])
    sections = replaced(base, varied_numbers(base, keys, values)).elements
    parts: dict[Load, list[_Part]] = {load: [] for load in stated.given}
    other = np.zeros(members, bool)
    for name in _inputs(base):
        section = sections[name]
        amplitude = np.abs(section.amplitude)
        load = next((bounded for bounded in parts if bounded.kind in section.quantity), None)
        if load is None:
            other |= amplitude != 0
            continue
        places = zip(getattr(section, "point", load.point), load.point, strict=True)
        other |= reduce(np.logical_or, (a != b for a, b in places)) & (amplitude != 0)
        extent = reduce(np.maximum, map(np.abs, extremes(section.signal)))
        extent = np.where(amplitude == 0, 0.0, extent)
        direction = np.array([*map(bounded_decimal, section.direction)])
        parts[load].append(_Part(section.quantity, amplitude, extent, direction))
    below, largest = ~other, {}
    for load, bound in stated.given.items():
        limit, inputs = float(bound), parts[load]
        square = sum((_product(a, b) for a in inputs for b in inputs), Bounded(0.0, 0.0))
        fits = square.high <= (bounded_decimal(limit) ** 2).low
        if len(inputs) == 1:  # the order of decimals is that of their doubles
            fits = fits | ((inputs[0].extent <= 1) & (inputs[0].amplitude <= limit))
        below &= fits
        largest[load.kind] = np.broadcast_to(np.sqrt(square.value), members)
    return Disturbances(largest, below, other)


def _product(first: _Part, second: _Part) -> Any:
    """Return A_i |G_ij| A_j."""
    product = math.prod(bounded_decimal(x) for part in (first, second) for x in part[1:3])
    if first is second or first.frame != second.frame:
        return product
    a, b = first.direction, second.direction
    cosine = (a @ b) / (sqrt(a @ a) * sqrt(b @ b))
    return product * Bounded(np.abs(cosine.value), cosine.error)
