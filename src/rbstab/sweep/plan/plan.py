"""A plan: its members are copies of a base config with some values varied.

Members are numbered from 0. The config of a member is made only when it is needed.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from math import prod
from typing import Any

import numpy as np

from rbstab.config.build import problem_of
from rbstab.config.load import changed_config, identifying, identity_of
from rbstab.config.numbers import replaced, value_or_none
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import may_run_code
from rbstab.files.text import line
from rbstab.integrate.problem import Problem
from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.axes import VARIANT, Axis, VariedKey, varied_numbers
from rbstab.sweep.plan.designs import Design
from rbstab.sweep.plan.distributions import FiniteList, Member
from rbstab.sweep.plan.plan_file import PLAN_VERSION, PlanFile, TraceSelection
from rbstab.sweep.plan.proof_selection import ProofSelection

MAX_MEMBERS = 100_000_000
"""Largest number of members. A billion would take two cores most of a day and fill a disk."""

MAX_TITLE_LENGTH = 200


@dataclass(frozen=True, eq=False, repr=False)
class Plan:
    """The plan of a sweep, made by `load_plan`; see docs/sweeps.md.

    Args:
        file: What the file of the plan says.
        bases: The base of each variant, in the order of the variants in the plan.
        axes: The varied keys, in groups that vary together.
        design: The points from which the axes without `each` draw their values; None for a grid.
    """

    file: PlanFile
    bases: Mapping[str, Config]
    axes: tuple[Axis, ...]
    design: Design | None

    @property
    def title(self) -> str:
        """The title of the sweep."""
        return self.file.title

    @cached_property
    def keep(self) -> TraceSelection:
        """Selects the members with traces."""
        return self.file.traces

    @cached_property
    def prove(self) -> ProofSelection | None:
        """Selects the members whose exact motions are enclosed; None: no member."""
        return self.file.proofs

    def __repr__(self) -> str:
        """Return one line: title, members, variants, varied keys."""
        keys = f"varies {', '.join(varied.key for varied in self.varied_keys)}"
        return line("Plan", self.title, [f"{self.members} members", *self.variants, keys])

    @property
    def varied_keys(self) -> tuple[VariedKey, ...]:
        """All varied keys, in the order of the plan."""
        return tuple(varied for axis in self.axes for varied in axis.varied_keys)

    @property
    def variants(self) -> tuple[str, ...]:
        """The variants of the members."""
        return tuple(self.bases)

    @property
    def engine(self) -> str:
        """The name of the engine of all members, which the base sets."""
        return next(iter(self.bases.values())).integration.engine

    @property
    def may_run_code(self) -> bool:
        """Whether the code of users may be run, if the plan has any."""
        return any(may_run_code(base) for base in self.bases.values())

    @cached_property
    def initial_value_problems(self) -> dict[str, Problem]:
        """The initial value problem of each variant's base, built once."""
        return {variant: problem_of(base) for variant, base in self.bases.items()}

    @property
    def dimensions(self) -> dict[str, int]:
        """The names and lengths of the dimensions that the member number counts, slowest first.

        A grid has all its axes as dimensions. Any other design has the axes marked `each`, and then
        its points. An array with one entry per member can be reshaped to these lengths.
        """
        counted = {
            axis.name: axis.length or 1
            for axis in self.axes
            if (self.design is None or axis.each) and not axis.counts_members
        }
        return counted if self.design is None else counted | {"point": self.design.points}

    @property
    def members(self) -> int:
        """The number of members."""
        return prod(self.dimensions.values())

    def values(
        self, start: int, stop: int, keys: Collection[str] | None = None
    ) -> dict[str, Array]:
        """Return the values of varied keys for the members from number `start` up to `stop`.

        The bits of a value do not depend on `start` and `stop`.

        Args:
            start: From 0.
            stop: At most `members`.
            keys: The wanted keys; default all varied keys.

        Returns:
            The values (or factors) of each key, shape (stop - start,). The values of
            `controller.variant` are texts in an object array.

        Raises:
            IndexError: The plan has no such members.
        """
        if not 0 <= start <= stop <= self.members:
            raise IndexError(f"members {start} to {stop} of a plan with {self.members}")
        numbers = np.arange(start, stop)
        _, *indices = np.unravel_index(numbers, (1, *self.dimensions.values()))
        at: dict[str, Array] = dict(zip(self.dimensions, indices, strict=True))
        # In a design all entries of `each` get the numbers of their points.
        counted = at.pop("point", numbers)
        at |= {axis.name: counted for axis in self.axes if axis.counts_members}
        wanted = [
            (axis.name, varied)
            for axis in self.axes
            for varied in axis.varied_keys
            if keys is None or varied.key in keys
        ]
        if self.design is not None and any(name not in at for name, _ in wanted):
            drawn = [axis.name for axis in self.axes if axis.name not in at]
            at |= dict(zip(drawn, _coordinates(self.design, start, stop), strict=True))
        return {varied.key: _values_of(varied, at[name]) for name, varied in wanted}

    def base_of(self, variant: str) -> Config:
        """Return the base of a variant; its members differ from it at the varied keys.

        Raises:
            KeyError: No member has this variant.
        """
        return self.bases[variant]

    def varied_keys_of(self, variant: str) -> tuple[VariedKey, ...]:
        """Return the varied keys that a variant has; the others do not affect its members."""
        keys = (varied for varied in self.varied_keys if varied.path != VARIANT)
        template = self.templates[variant]
        return tuple(varied for varied in keys if value_or_none(template, varied.path) is not None)

    def variant_of(self, values: Mapping[str, Any]) -> str:
        """Return the variant of a member with these values."""
        return str(values.get("controller.variant", self.variants[0]))

    @property
    def in_quaternions(self) -> bool:
        """Whether all members are integrated in quaternions: their Θ may have any turns."""
        return all(base.integration.coordinates == "quaternion" for base in self.bases.values())

    def config_of(self, index: int) -> Config:
        """Return the config of a member: the base with the member's values, validated.

        Its title is the title of the base, followed by the number of the member.

        Raises:
            IndexError: The plan has no such member.
        """
        values = {
            key: entries.tolist()[0] for key, entries in self.values(index, index + 1).items()
        }
        variant = self.variant_of(values)
        base, suffix = self.bases[variant], f", member {index}"
        title = base.title[: MAX_TITLE_LENGTH - len(suffix)] + suffix
        return changed_config(base, self.data_of(variant, values) | {"title": title})

    def data_of(self, variant: str, values: Mapping[str, Any]) -> dict[str, Any]:
        """Return the base of a variant with these values as plain data, without validation."""
        template, given = self.templates[variant], self.varied_keys_of(variant)
        given = tuple(varied for varied in given if varied.key in values)
        data: dict[str, Any] = replaced(template, varied_numbers(template, given, values))
        return data

    @cached_property
    def templates(self) -> dict[str, dict[str, Any]]:
        """The bases as plain data with all defaults filled in. Do not change them."""
        return {name: base.plain() for name, base in self.bases.items()}


def _coordinates(design: Design, start: int, stop: int) -> Array:
    """Return the coordinates of members, whose points repeat, shape (dimensions, stop - start)."""
    first = start % design.points
    end = first + stop - start
    if end <= design.points:
        return design.draw(first, end)
    if stop - start < design.points:
        parts = design.draw(first, design.points), design.draw(0, end - design.points)
        return np.hstack(parts)
    drawn: Array = design.draw(0, design.points)[:, np.arange(first, end) % design.points]
    return drawn


def plan_id(plan: Plan) -> str:
    """Return the identity of a sweep: the first 32 hexadecimal digits of a SHA-256.

    The hash covers everything that defines the members (the resolved bases, the varied keys, the
    design, members and seed) and the selections of traces and of proofs, in the canonical form of
    `run_id`. It does not cover the title of the plan.
    """
    design = plan.design
    content: dict[str, Any] = {
        "version": PLAN_VERSION,
        "bases": [identifying(base) for base in plan.bases.values()],
        "vary": [
            [
                axis.name,
                axis.each,
                [
                    [k.key, k.scale, k.distribution.keyword, list(k.distribution.root)]
                    for k in axis.varied_keys
                ],
            ]
            for axis in plan.axes
        ],
        "design": [design.keyword, design.points, design.seed] if design is not None else ["grid"],
        "keep": [plan.keep.every, plan.keep.members],
    }
    if plan.prove is not None:
        # Plans without proofs keep the identity that they had before there was this key.
        content["prove"] = [plan.prove.steps, plan.prove.members]
    return identity_of(content)


def _values_of(varied: VariedKey, indices_or_coordinates: Array) -> Array:
    """Return the values at indices of a list (integers), or at coordinates of a design."""
    distribution = varied.distribution
    if indices_or_coordinates.dtype.kind == "i":
        assert isinstance(distribution, FiniteList | Member)
        values = distribution.at(indices_or_coordinates)
    else:
        values = distribution.quantile(indices_or_coordinates)
    # -0.0 becomes 0.0, as in a config.
    return values if values.dtype == object else values + 0.0
