"""Tuning: find gains that minimize an objective of a run."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rbstab.config.load import changed_config, load_config, resolved
from rbstab.config.schema import Config
from rbstab.experiment.tuning.gain_scaling import GainScaling, gain_scalings
from rbstab.experiment.tuning.objective import OBJECTIVES, Objective
from rbstab.experiment.tuning.sensitivities import (
    UnsuitedConfigError,
    check_suited,
    unsuited_motions,
)
from rbstab.files.text import line

MAX_TITLE_LENGTH = 200

MIN_IMPROVEMENT = 1e-6
"""Smallest relative improvement with which a config counts as better."""


@dataclass(frozen=True, eq=False, repr=False)
class Tuned:
    """The result of `tune`: a better config, and what was gained.

    Attributes:
        config: The best config; the given one if no better one was found.
        objective: The objective that was minimized, with `name`, `symbol` and `unit`.
        scalings: The gains that were scaled.
        factors: Their factors, in the order of `scalings`.
        given: The objective of the given config, in its unit; infinite if its run fails or has no
            finite objective, for example because it does not settle.
        value: The objective of `config`, in its unit.
        runs: Number of runs.
        failures: Number of runs that failed or had no finite objective.
    """

    config: Config
    objective: Objective
    scalings: tuple[GainScaling, ...]
    factors: tuple[float, ...]
    given: float
    value: float
    runs: int
    failures: int

    def __repr__(self) -> str:
        """Return one line: the objective before and after, and the factors."""
        name, unit = self.objective.name, self.objective.unit
        change = f"{name} {self.given:.4g} {unit} -> {self.value:.4g} {unit}"
        factors = [
            f"{scaling.key} times {factor:.4g}"
            for scaling, factor in zip(self.scalings, self.factors, strict=True)
        ]
        return line("Tuned", self.config.title, [change, *factors, f"{self.runs} runs"])

    @property
    def better(self) -> bool:
        """Whether a better config was found."""
        return self.value < self.given


def tune(
    config: Config | str | Path | Mapping[str, Any],
    objective: str,
    over: str | Iterable[str],
    bounds: tuple[float, float] = (0.1, 10.0),
    *,
    allow_python: bool = False,
) -> Tuned:
    """Scale gains of a config to minimize an objective of its run.

    Each gain is multiplied by a factor within `bounds`. First, a fixed sample of factors is run.
    Then L-BFGS-B minimizes the objective over the logarithms of the factors, from the given config
    and from the best of the sample, with gradients from variational equations. The best config of
    all runs is returned. It is at least a local optimum where the objective is smooth. The
    objective is not smooth where another peak in time becomes the highest, where v passes its
    threshold while v' is zero, or where the motion meets other switches or impacts. There a descent
    may stop early.

    Args:
        config: A config, or any argument that `load_config` takes.
        objective: "settling_time", s, "peak_displacement", the largest |E|, m, or "energy",
            ∫v dt, J s.
        over: Keys of gains, such as `controller.L_c` or `controller.L_c[0]`; or a single key.
        bounds: The smallest and the largest factor; 1 must be within the bounds.
        allow_python: As for `load_config`.

    Returns:
        The best config, its factors, and the objective before and after.

    Raises:
        ConfigError: The config is invalid.
        UnsuitedConfigError: As for `sensitivities`; or the objective is constant for this config.
        TuningError: `over` is wrong.
        EngineMissingError: heyoka is not installed.
        ValueError: There is no such objective, or 1 is not within the bounds.
    """
    config = load_config(config, allow_python=allow_python)
    check_suited(config)
    if objective not in OBJECTIVES:
        raise ValueError(f"objective: is '{objective}' (expected one of {', '.join(OBJECTIVES)})")
    keys = [over] if isinstance(over, str) else over
    chosen, scalings = OBJECTIVES[objective], gain_scalings(config, keys)
    variant: str = config.controller.variant
    if chosen.name == "peak_displacement" and variant == "permanent":
        raise UnsuitedConfigError(
            "controller.variant: is 'permanent', whose contact point does not move "
            "(expected another objective, or another variant)"
        )
    if not 0 < bounds[0] <= 1 <= bounds[1] < math.inf:
        raise ValueError("bounds: expected 0 < smallest factor <= 1 <= largest factor")
    # Imported late: the engine must be installed, which was checked above.
    from rbstab.experiment.tuning.search import Search

    search = Search(config, chosen, scalings, bounds)
    with unsuited_motions():
        given = search.minimize()
    least = MIN_IMPROVEMENT * abs(given if math.isfinite(given) else 0.0)
    factors, value = (1.0,) * len(scalings), given
    if search.best_value < given - least:
        tuned, suffix = search.config_at(search.best), f", tuned for {chosen.name}"
        title = tuned.title[: MAX_TITLE_LENGTH - len(suffix)] + suffix
        config = changed_config(tuned, resolved(tuned) | {"title": title})
        factors, value = tuple(search.factors(search.best)), search.best_value
    return Tuned(config, chosen, scalings, factors, given, value, search.runs, search.failures)
