"""Members in groups to be compared: by variant, or by what a design takes `each` entry of."""

from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.sweeps.members import Members
from rbstab.report.sweeps.parameters import Parameter

MAX_SHOWN = 12
"""Groups that are compared with each other; more of them are better seen in a map."""


class Slice(NamedTuple):
    """Some of the members: what they have in common, and their numbers (None: all)."""

    title: str
    chosen: Array | None


class PairedConditions(NamedTuple):
    """Groups of members.

    labels are the names of the groups, codes the group of each member, shape (n,); pairs has the
    numbers of members in rows that differ in their group alone, shape (rows, groups), or is None.
    """

    parameters: tuple[Parameter, ...]
    labels: tuple[str, ...]
    codes: Array
    pairs: Array | None


def paired_conditions_of(members: Members) -> PairedConditions | None:
    """The groups of a sweep; None where there is nothing, or too much, to compare."""
    plan = members.plan
    if plan is None:
        return None
    variant = [p for p in members.parameters if p.axis.words]
    each = {axis.name for axis in plan.axes if axis.each}
    chosen = [p for p in members.parameters if p.axis.words or p.name in each]
    if np.prod([float(len(p.entries)) for p in chosen]) > MAX_SHOWN:
        chosen = variant
    if not chosen:
        return None
    labels, codes = [""], np.zeros(len(members), dtype=np.int64)
    for parameter in chosen:
        codes = codes * len(parameter.entries) + np.searchsorted(
            parameter.entries, parameter.values
        )
        labels = [
            f"{label}, {_said(parameter, entry)}".removeprefix(", ")
            for label in labels
            for entry in parameter.entries.tolist()
        ]
    pairs = _pairs(members, [p.name for p in chosen])
    return PairedConditions(tuple(chosen), tuple(labels), codes, pairs)


def _said(parameter: Parameter, entry: float) -> str:
    if parameter.axis.words:
        return parameter.axis.words[int(entry)]
    return f"{parameter.axis.label} = {entry:.4g}"


def _pairs(members: Members, names: list[str]) -> Array | None:
    """Members that differ in some axes alone; None where these are drawn like the others."""
    assert members.plan is not None
    dimensions = members.plan.dimensions
    if any(name not in dimensions for name in names):
        return None
    axes = list(dimensions)
    numbers = np.arange(len(members)).reshape(tuple(dimensions.values()))
    others = [axis for axis in axes if axis not in names]
    moved = numbers.transpose([axes.index(name) for name in (*others, *names)])
    sizes = [dimensions[name] for name in names]
    return moved.reshape(-1, int(np.prod(sizes)))
