"""Conditions to compare: variants, and parameters marked `each` in the plan."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rbstab.config.numbers import is_of_initial_state
from rbstab.mechanics.numbers import Array
from rbstab.report.sweeps.members import Members, kept
from rbstab.report.sweeps.parameters import Parameter
from rbstab.sweep.plan.plan import Plan

MAX_GROUPS = 12
"""Maximum number of conditions to compare; more of them are easier to see in a map."""


class Slice(NamedTuple):
    """A selection of members: its title, and the numbers of the members, ascending."""

    title: str
    chosen: Array


@dataclass(frozen=True, eq=False)
class Conditions:
    """Groups of members with the same condition; without conditions, one group without a title.

    slices are the members of each. Each row of pairs, shape (rows, conditions), has the numbers of
    members that differ only in their condition; pairs is None if there are no such rows. v_differs
    says whether v may be another function in each condition.
    """

    parameters: tuple[Parameter, ...]
    slices: list[Slice]
    pairs: Array | None
    v_differs: bool

    @property
    def labels(self) -> tuple[str, ...]:
        """The names of the conditions."""
        return tuple(part.title for part in self.slices)


@kept
def conditions_of(members: Members) -> Conditions:
    """Return the conditions of a sweep; none if they are too many to compare."""
    plan, slices = members.plan, [Slice("", np.arange(len(members)))]
    if plan is None:
        return Conditions((), slices, None, v_differs=False)
    variant = [p for p in members.parameters if p.axis.categories]
    each = {axis.name for axis in plan.axes if axis.each}
    chosen = [p for p in members.parameters if p.axis.categories or p.name in each]
    if math.prod(len(p.entries) for p in chosen) > MAX_GROUPS:
        chosen = variant
    if not chosen:
        return Conditions((), slices, None, v_differs=False)
    for parameter in chosen:
        slices = [
            Slice(
                f"{part.title}, {_condition(parameter, entry)}".removeprefix(", "),
                part.chosen[parameter.values[part.chosen] == entry],
            )
            for part in slices
            for entry in parameter.entries.tolist()
        ]
    names = [p.name for p in chosen]
    return Conditions(tuple(chosen), slices, _pairs(plan, names), _change_v(plan, names))


def _change_v(plan: Plan, names: list[str]) -> bool:
    """Return whether v may be another function along some axes."""
    keys = [key for axis in plan.axes if axis.name in names for key in axis.varied_keys]
    elements = plan.bases[plan.variants[0]].elements
    # It is not along those of starts and inputs: v is the energy of the body and of what acts on
    # it, less that at rest.
    return not all(
        is_of_initial_state(key.path)
        or (key.path[0] == "elements" and elements[str(key.path[1])].kind == "input")
        for key in keys
    )


def _condition(parameter: Parameter, entry: float) -> str:
    if parameter.axis.categories:
        return parameter.axis.categories[int(entry)]
    unit = parameter.axis.unit
    return f"{parameter.axis.label} = {entry:.4g}" + (f" {unit}" if unit not in ("", "1") else "")


def _pairs(plan: Plan, names: list[str]) -> Array | None:
    """Return rows of members that differ only along named axes; None if one of these is sampled."""
    dimensions = plan.dimensions
    if any(name not in dimensions for name in names):
        return None
    axes = list(dimensions)
    numbers = np.arange(math.prod(dimensions.values())).reshape(*dimensions.values())
    moved = np.moveaxis(numbers, [axes.index(name) for name in names], range(-len(names), 0))
    return moved.reshape(-1, math.prod(dimensions[name] for name in names))  # (rows, conditions)
