"""From the values of members to the parameters and starts of their systems, for many at once."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from rbstab.config.build import problem_of
from rbstab.config.entries import replaced, value_at
from rbstab.config.schema import Config
from rbstab.config.source import Path
from rbstab.integrate.heyoka.compiled_map import CompiledMap
from rbstab.integrate.heyoka.ensemble import parameters_and_start
from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.plan import Plan


class Binding:
    """What the members of one variant are made of.

    The config is turned into its system as for a single run (`problem_of`), once, with symbols in
    place of the numbers that vary.

    Args:
        plan: The plan.
        variant: The variant of the members.

    Attributes:
        varies: Which parameters differ between members, shape (parameters,).
    """

    def __init__(self, plan: Plan, variant: str) -> None:
        self.base = plan.base_of(variant)
        self.columns = plan.columns_of(variant)
        self.problem = problem_of(self.base)
        self.size = self.problem.system.size
        self.paths = [path for column in self.columns for path, _ in self._numbers(column.path)]

        def made(numbers: Array) -> Array:
            values = dict(zip(self.paths, numbers.tolist(), strict=True))
            problem = problem_of(replaced(self.base, values))
            return parameters_and_start(problem.system, problem.start)

        self.compiled = CompiledMap(made, len(self.paths))
        self.varies = self.compiled.varies[: -self.size]

    def of(self, values: dict[str, Array]) -> tuple[Array, Array]:
        """Parameters, shape (parameters, m), and starts, shape (states, m).

        Args:
            values: What `Plan.values` says of the members, each of shape (m,).
        """
        members = len(next(iter(values.values())))
        rows: list[Array] = []
        for column in self.columns:
            given = values[column.key].astype(float)
            for _, number in self._numbers(column.path):
                rows.append(given * number if column.scale else given)
        numbers = np.array(rows) if rows else np.zeros((0, members))
        found = self.compiled(numbers)
        return found[: -self.size], found[-self.size :]

    def config_of(self, row: dict[str, float]) -> Config:
        """The config of one member from its values, not validated."""
        numbers = {}
        for column in self.columns:
            given = float(row[column.key])
            for path, number in self._numbers(column.path):
                numbers[path] = given * number if column.scale else given
        return replaced(self.base, numbers)

    def _numbers(self, path: Path) -> Iterator[tuple[Path, float]]:
        """The numbers at a path of the base and below it."""
        yield from _below(value_at(self.base, path), path)


def _below(value: Any, path: Path) -> Iterator[tuple[Path, float]]:
    if isinstance(value, tuple):
        for index, entry in enumerate(value):
            yield from _below(entry, (*path, index))
    else:
        yield path, value
