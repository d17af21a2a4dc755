"""A plan: numbered members, each the base with some of its values varied, made when asked for."""

import hashlib
import json
from collections.abc import Collection, Mapping
from copy import deepcopy
from dataclasses import dataclass
from functools import cached_property
from math import prod
from typing import Any

import numpy as np

from rbstab.config.load import load_config, resolved
from rbstab.config.schema import Config
from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.axes import VARIANT, Axis, Column, at
from rbstab.sweep.plan.designs import Design
from rbstab.sweep.plan.distributions import FiniteList
from rbstab.sweep.plan.trace_selection import TraceSelection

PLAN_VERSION = 1

MAX_MEMBERS = 100_000_000
"""Of a plan: a billion would take two cores most of a day and fill a disk."""

MAX_LATIN_MEMBERS = 2_000_000
"""Points of a latin hypercube, whose intervals are kept in memory."""

MAX_TITLE_LENGTH = 200


@dataclass(frozen=True, eq=False)
class Plan:
    """The members of a sweep; see docs/sweeps.md. `load_plan` makes one.

    Args:
        title: Of the sweep.
        bases: The base of each variant, in the order in which the plan names them.
        axes: What is varied.
        design: What the axes that are not counted draw from; None for a grid.
        keep: Which members have traces.
    """

    title: str
    bases: Mapping[str, Config]
    axes: tuple[Axis, ...]
    design: Design | None
    keep: TraceSelection

    @property
    def columns(self) -> tuple[Column, ...]:
        """All columns, in the order of the plan."""
        return tuple(column for axis in self.axes for column in axis.columns)

    @property
    def variants(self) -> tuple[str, ...]:
        """The variants that members have."""
        return tuple(self.bases)

    @property
    def engine(self) -> str:
        """The engine of all members, as the base says."""
        return next(iter(self.bases.values())).integration.engine

    @property
    def dimensions(self) -> dict[str, int]:
        """The axes along which members are counted, slowest first, with their lengths.

        An array along members takes this shape: those of a grid, or those marked `each` and the
        points of the design.
        """
        counted = {axis.name: axis.length or 1 for axis in self.axes if self._counts(axis)}
        return counted if self.design is None else counted | {"point": self.design.points}

    @property
    def members(self) -> int:
        """How many there are."""
        return prod(self.dimensions.values())

    def values(
        self, start: int, stop: int, keys: Collection[str] | None = None
    ) -> dict[str, Array]:
        """What is varied, for the members from number `start` up to `stop`.

        The bits of a value do not depend on how the members are cut.

        Args:
            start: From 0.
            stop: At most `members`.
            keys: Those of the columns that are wanted; default all.

        Returns:
            For each column its values (or factors), shape (stop - start,); those of
            `controller.variant` are texts in an object array.

        Raises:
            IndexError: There are no such members.
        """
        if not 0 <= start <= stop <= self.members:
            raise IndexError(f"members {start} to {stop} of a plan with {self.members}")
        places = self._places(start, stop)
        wanted = [
            (axis.name, column)
            for axis in self.axes
            for column in axis.columns
            if keys is None or column.key in keys
        ]
        if any(name not in places for name, _ in wanted):
            places |= self._coordinates(start, stop)
        return {column.key: _values_of(column, places[name]) for name, column in wanted}

    def base_of(self, variant: str) -> Config:
        """The config of a variant that its members differ from by their columns.

        Raises:
            KeyError: No member has this variant.
        """
        return self.bases[variant]

    def columns_of(self, variant: str) -> tuple[Column, ...]:
        """The columns that a variant has a key for; others are without effect on its members."""
        return tuple(c for c in self.columns if c.path != VARIANT and self._has(variant, c))

    def variant_of(self, values: Mapping[str, Any]) -> str:
        """The variant of a member from its values."""
        return str(values.get("controller.variant", self.variants[0]))

    def config_of(self, index: int) -> Config:
        """The config of one member, as `load_config` makes it from the base with its values.

        Its title is that of the base with the number of the member.

        Raises:
            IndexError: There is no such member.
        """
        values = {key: found.tolist()[0] for key, found in self.values(index, index + 1).items()}
        variant = self.variant_of(values)
        title = self.title_of(variant, index)
        return load_config(self.data_of(variant, values) | {"title": title})

    def title_of(self, variant: str, index: int) -> str:
        """The title of a member of a variant."""
        suffix = f", member {index}"
        return self.bases[variant].title[: MAX_TITLE_LENGTH - len(suffix)] + suffix

    def data_of(self, variant: str, values: Mapping[str, Any]) -> dict[str, Any]:
        """The base of a variant as plain data with some columns' values put in, not validated."""
        data: dict[str, Any] = deepcopy(self.templates[variant])
        for column in self.columns_of(variant):
            if column.key in values:
                column.applied(data, values[column.key])
        return data

    @cached_property
    def templates(self) -> dict[str, dict[str, Any]]:
        """The bases as plain data with every default filled in; not to be changed."""
        return {name: _template_of(base) for name, base in self.bases.items()}

    def _has(self, variant: str, column: Column) -> bool:
        try:
            at(self.templates[variant], column.path)
        except LookupError:
            return False
        return True

    def _counts(self, axis: Axis) -> bool:
        return self.design is None or axis.each

    def _places(self, start: int, stop: int) -> dict[str, Array]:
        """The index of the entry of each axis that is counted, the last axis fastest."""
        entries, places = self._numbers(start, stop)[0], {}
        for axis in reversed([axis for axis in self.axes if self._counts(axis)]):
            length = axis.length or 1
            places[axis.name] = entries % length
            entries = entries // length
        return places

    def _coordinates(self, start: int, stop: int) -> dict[str, Array]:
        """The coordinate of each axis that is drawn."""
        assert self.design is not None
        if stop - start >= self.design.points:
            points = self._numbers(start, stop)[1]
            u = self.design.part(0, self.design.points)[:, points]
        else:
            # At most one end of the design lies inside: a piece up to it, and one behind it.
            first = start % self.design.points
            until = min(first + stop - start, self.design.points)
            behind = stop - start - (until - first)
            u = self.design.part(first, until)
            u = np.hstack([u, self.design.part(0, behind)]) if behind else u
        drawn = [axis.name for axis in self.axes if not self._counts(axis)]
        return dict(zip(drawn, u, strict=True))

    def _numbers(self, start: int, stop: int) -> tuple[Array, Array]:
        """For each member the number of its entry of what is counted, and that of its point."""
        points = 1 if self.design is None else self.design.points
        numbers = np.arange(start, stop)
        return numbers // points, numbers % points


def _template_of(config: Config) -> dict[str, Any]:
    """A config as plain data with every default filled in; it loads again as the same config."""
    data: dict[str, Any] = config.model_dump(mode="json", exclude_none=True)
    return data


def plan_id(plan: Plan) -> str:
    """The identity of a sweep: the first 32 hexadecimal digits of a SHA-256.

    Hashed is everything that its members follow from (the resolved bases, what is varied, the
    design, members and seed) and which traces are kept, in the canonical form of `run_id`. The
    plan's title is not.
    """
    design = plan.design
    content = {
        "version": PLAN_VERSION,
        "bases": [resolved(base) for base in plan.bases.values()],
        "vary": [
            [axis.name, axis.each, [[c.key, c.scale, *_spelled(c)] for c in axis.columns]]
            for axis in plan.axes
        ],
        "design": [design.word, design.points, design.seed] if design is not None else ["grid"],
        "keep": [plan.keep.every, plan.keep.members],
    }
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def _spelled(column: Column) -> list[Any]:
    return [column.distribution.word, column.distribution.arguments]


def _values_of(column: Column, place: Array) -> Array:
    """The values at indices of entries, or at coordinates."""
    distribution = column.distribution
    if place.dtype.kind == "i":
        assert isinstance(distribution, FiniteList)
        found = distribution.at(place)
    else:
        found = distribution.quantile(place)
    # -0.0 and 0.0 are one value, here as in a config.
    return found if found.dtype == object else found + 0.0
