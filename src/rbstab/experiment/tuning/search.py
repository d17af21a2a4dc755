"""Search for the factors of a tuning."""

import math
from itertools import chain

import numpy as np

from rbstab.analysis.sensitivity import baseline
from rbstab.config.build import problem_of
from rbstab.config.load import with_numbers
from rbstab.config.schema import Config
from rbstab.config.source import Path
from rbstab.experiment.tuning.gain_scaling import GainScaling
from rbstab.experiment.tuning.objective import Objective
from rbstab.experiment.tuning.sensitivities import outcome_slope
from rbstab.integrate.status import UnfinishedRunError
from rbstab.integrate.switching.saltation import NotDifferentiableError
from rbstab.mechanics.numbers import Array

SAMPLES = 32
"""Number of configs sampled within the bounds, before the descents."""

MAX_STEPS = 40
"""Maximum number of steps of each descent."""

FAILURE_PENALTY = 10.0
"""In a descent, a failed run counts as this many times the worst value seen."""

RUN_ERRORS = (UnfinishedRunError, ArithmeticError, ValueError)
"""Errors that a run with extreme gains may raise; a `ConfigError` is a ValueError."""


class Search:
    """The objective as a function of the logarithms x of the factors, and the best x so far.

    Args:
        config: The config to scale.
        objective: The number to minimize.
        scalings: The gains to scale.
        bounds: The smallest and the largest factor.
    """

    def __init__(
        self,
        config: Config,
        objective: Objective,
        scalings: tuple[GainScaling, ...],
        bounds: tuple[float, float],
    ) -> None:
        self.config, self.objective, self.scalings = config, objective, scalings
        self.bounds, self.logs = bounds, (math.log(bounds[0]), math.log(bounds[1]))
        self.best, self.best_value, self.worst = np.zeros(len(scalings)), math.inf, 0.0
        self.runs = self.failures = 0

    def factors(self, x: Array) -> list[float]:
        """Return the factors at x; rounding never moves them out of the bounds."""
        return np.clip(np.exp(x), *self.bounds).tolist()

    def config_at(self, x: Array) -> Config:
        """Return the config scaled by the factors at x, validated.

        Raises:
            ConfigError: A scaled gain is not valid, for example because it is not finite.
        """
        return with_numbers(self.config, dict(chain.from_iterable(self._gains(x))))

    def _gains(self, x: Array) -> list[list[tuple[Path, float]]]:
        """Return the paths and the numbers of the gains at x, for each scaling."""
        return [
            [(path, factor * entry.value) for entry in scaling.entries for path in entry.paths]
            for factor, scaling in zip(self.factors(x), self.scalings, strict=True)
        ]

    def minimize(self) -> float:
        """Search from a sample of the bounds and from the given config; return its objective.

        The sample is a Latin hypercube, the same at every call.
        """
        rng, start = np.random.default_rng(0), np.zeros(len(self.scalings))
        shape = SAMPLES, len(start)
        ranks = rng.permuted(np.tile(np.arange(SAMPLES)[:, None], shape[1]), axis=0)
        low, high = self.logs
        sample = low + (high - low) * (ranks + rng.uniform(size=shape)) / SAMPLES
        given = self.value(start)
        for x in (start, min(sample, key=self.value)):
            self._descend(x)
        return given

    def _descend(self, x: Array) -> None:
        """Descend along the gradient from x, if the objective at x is finite and positive."""
        # Imported late: importing scipy.optimize takes longer than many runs.
        from scipy.optimize import minimize

        scale = self.value(x)
        if not 0 < scale < math.inf:
            return

        def function(x: Array) -> tuple[float, Array]:
            value, slope = self.evaluate(x, gradient=True)
            if not (math.isfinite(value) and np.isfinite(slope).all()):
                return FAILURE_PENALTY * self.worst / scale, np.zeros(len(x))
            return value / scale, slope / scale

        limits = [self.logs] * len(x)
        options = {"maxiter": MAX_STEPS, "maxfun": 2 * MAX_STEPS}
        minimize(function, x, jac=True, method="L-BFGS-B", bounds=limits, options=options)

    def value(self, x: Array) -> float:
        """Return the objective at x; infinite if the run fails or has no finite objective."""
        return self.evaluate(x, gradient=False)[0]

    def evaluate(self, x: Array, *, gradient: bool) -> tuple[float, Array]:
        """Return the objective at x and, if `gradient`, its gradient (otherwise zeros).

        The objective is infinite if the run fails or has no finite objective.

        Raises:
            NotDifferentiableError: The motion of the given config has no derivatives.
        """
        self.runs += 1
        value, slope = math.inf, np.zeros(len(x))
        try:
            with np.errstate(all="ignore"):
                config = self.config_at(x)
                base = baseline(problem_of(config))
                value = self.objective.of(base.outcome)
                # The derivative of a scaled gain by log(factor) is the scaled gain.
                for index, gains in enumerate(self._gains(x) if gradient else ()):
                    slope[index] = self.objective.of(outcome_slope(base, config, gains))
        except RUN_ERRORS as error:
            if isinstance(error, NotDifferentiableError) and not x.any():
                raise
            value = math.inf
        if not math.isfinite(value):
            self.failures += 1
            return math.inf, np.zeros(len(x))
        self.worst = max(self.worst, value)
        if value < self.best_value:
            self.best_value, self.best = value, np.array(x)
        return value, slope
