"""Converting the values of many members to parameters and initial states of their systems."""

import numpy as np

from rbstab.config.build import problem_of
from rbstab.config.numbers import replaced
from rbstab.config.schema import Config
from rbstab.integrate.heyoka.compiled_map import compiled_map
from rbstab.integrate.heyoka.symbols import parameters_and_start
from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.axes import varied_numbers, varied_paths
from rbstab.sweep.plan.plan import Plan


class Binding:
    """The conversion of varied values to parameters and initial states, for one variant.

    The system is built once as for a single run (`problem_of`), with symbols for the varied
    numbers. The resulting expressions are compiled.

    Args:
        plan: The plan.
        variant: The variant of the members.

    Attributes:
        varies: Whether each parameter differs between members, shape (parameters,).
    """

    def __init__(self, plan: Plan, variant: str) -> None:
        self.base = plan.base_of(variant)
        self.varied_keys = plan.varied_keys_of(variant)
        self.problem = plan.initial_value_problems[variant]
        self.size = self.problem.system.size
        self.paths = varied_paths(self.base, self.varied_keys)

        def evaluate(numbers: Array) -> Array:
            values = dict(zip(self.paths, numbers.tolist(), strict=True))
            problem = problem_of(replaced(self.base, values))
            return parameters_and_start(problem.system, problem.start)

        self.compiled = compiled_map(evaluate, len(self.paths))
        self.varies = self.compiled.varies[: -self.size]

    def parameters_and_starts(self, values: dict[str, Array]) -> tuple[Array, Array]:
        """Return parameters, shape (parameters, m), and initial states, shape (states, m).

        Args:
            values: The values of the members from `Plan.values`, each of shape (m,).
        """
        members = len(next(iter(values.values())))
        floats = {varied.key: values[varied.key].astype(float) for varied in self.varied_keys}
        rows = list(varied_numbers(self.base, self.varied_keys, floats).values())
        numbers = np.array(rows) if rows else np.zeros((0, members))
        result = self.compiled(numbers)
        return result[: -self.size], result[-self.size :]

    def config_of(self, row: dict[str, float]) -> Config:
        """Return the config of one member from its values, not validated."""
        floats = {varied.key: float(row[varied.key]) for varied in self.varied_keys}
        return replaced(self.base, varied_numbers(self.base, self.varied_keys, floats))
