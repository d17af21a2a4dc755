"""Fitting: find numbers of a config from a measured motion."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rbstab.config.build import problem_of
from rbstab.config.errors import ConfigError
from rbstab.config.files.measured import Measured, read_measured
from rbstab.config.load import load_config, with_numbers
from rbstab.config.numbers import Entry, entries_of, unit_at
from rbstab.config.schema import Config
from rbstab.config.units import NumberKey, number_key
from rbstab.experiment.tuning.determined import determined
from rbstab.experiment.tuning.fitted import Fitted, FittedColumn, FittedNumber
from rbstab.experiment.tuning.gain_scaling import TuningError
from rbstab.experiment.tuning.sensitivities import check_suited, shifted_along, unsuited_motions
from rbstab.experiment.tuning.tune import renamed
from rbstab.mechanics.numbers import Array

LEVEL = 0.95
"""The probability with which an interval holds the true number."""

MAX_RUNS = 100
"""The largest number of runs of one search."""

MAX_WEIGHINGS = 20
"""How often the columns are weighed by their scatter."""

SAME_WEIGHT = 1e-3
"""The scatter of a column is known when it changes less than this, relatively."""

LEAST_SCATTER = 1e-9
"""The scatter of a column is at least this part of its largest value: below is round-off."""

STATIONARY = 0.05
"""A minimum is found if a step to it would be shorter than this, in standard errors."""


def fit(
    config: Config | str | Path | Mapping[str, Any],
    data: str | Path,
    free: str | Iterable[str],
    *,
    allow_python: bool = False,
) -> Fitted:
    """Fit numbers of a config to a measured motion, by least squares.

    The sum over all columns of (measured - computed)² / σ² becomes least, from the given values.
    Each column has its own σ: the scatter of its residuals, found again until it stays. The
    derivatives are those of variational equations. The intervals are those of the linearised
    motion; they hold if the model is right and the errors of measurement are independent, normal,
    and of one size in a column.

    Args:
        config: A config, or any argument that `load_config` takes.
        data: The CSV file of the measured motion (`read_measured`).
        free: Keys of numbers, such as `controller.K_r`, `body.inertia[0]`, `initial.orientation`;
            or a single key. All numbers below a key are free.
        allow_python: As for `load_config`.

    Returns:
        The fitted config, the numbers with their intervals, and the residuals.

    Raises:
        ConfigError: The config or the data are wrong.
        TuningError: `free` is wrong, or a column has too few values for it.
        UnsuitedConfigError: As for `sensitivities`.
        EngineMissingError: heyoka is not installed.
        UnfinishedRunError: The run of the given config did not complete.
    """
    config = load_config(config, allow_python=allow_python)
    check_suited(config)
    entries = _free_entries(config, [free] if isinstance(free, str) else free)
    measured = read_measured(data, config.integration.duration)
    counts = np.isfinite(measured.values).sum(axis=0)
    if counts.min() <= len(entries):
        found = f"has a column of {counts.min()} values"
        wanted = f"expected more than the {len(entries)} free numbers"
        raise TuningError(f"{data}: {found} ({wanted})")
    # Imported late: importing scipy.optimize takes longer than many runs.
    from scipy.optimize import least_squares
    from scipy.special import stdtrit

    motion, x = FreeMotion(config, entries, measured), np.zeros(len(entries))
    least, total = LEAST_SCATTER * motion.scatter, counts.sum()
    freedom = total - len(x)
    with unsuited_motions(), np.errstate(all="ignore"):
        motion.computed(x)
        for _ in range(MAX_WEIGHINGS):
            search = least_squares(
                motion.residuals, x, motion.jacobian, x_scale="jac", max_nfev=MAX_RUNS
            )
            x, before = search.x, motion.scatter
            computed = motion.computed(x)
            squares = np.nanmean((measured.values - computed) ** 2, axis=0)
            motion.scatter = np.maximum(np.sqrt(squares * total / freedom), least)
            steady = np.allclose(motion.scatter, before, rtol=SAME_WEIGHT, atol=0.0)
            # Its status is 0 after too many runs.
            if steady or not search.status:
                break
    quantile = float(stdtrit(freedom, (1 + LEVEL) / 2))
    errors, loose, decrement = determined(search.jac, search.fun, quantile)
    values, rates = motion.numbers(x)
    numbers = zip(entries, values.tolist(), (rates * errors).tolist(), strict=True)
    # A gap counts as a residual of 0.
    residuals = np.nan_to_num((measured.values - computed) / motion.scatter)
    rho = (residuals[1:] * residuals[:-1]).sum(axis=0) / counts
    columns = zip(
        measured.columns, counts.tolist(), motion.scatter.tolist(), rho.tolist(), strict=True
    )
    return Fitted(
        renamed(motion.config_at(x), f", fitted to {Path(data).name[:100]}"),
        measured,
        tuple(
            FittedNumber(
                *(one.key, unit_at(config, one.key), one.value, value, error),
                *(value - quantile * error, value + quantile * error),
            )
            for one, value, error in numbers
        ),
        tuple(FittedColumn(one.name, one.unit, *row) for one, *row in columns),
        computed,
        loose,
        steady and decrement < STATIONARY,
    )


def _free_entries(config: Config, keys: Iterable[str]) -> list[Entry]:
    """Return the numbers at some keys and below them.

    Raises:
        TuningError: A key has no number that can be fitted, or one of another key.
    """
    found: list[Entry] = []
    for key in keys:
        path = (number_key(key) or NumberKey((key,))).path
        below = [e for e in entries_of(config) if path in [p[: len(path)] for p in e.paths]]
        if not below or {*below} & {*found}:
            expected = "expected numbers that `rbstab sensitivities` lists, each once"
            raise TuningError(f"{key}: is no number to fit ({expected})")
        found += below
    if not found:
        raise TuningError("no number to fit (expected a key such as controller.K_r)")
    return found


def _is_positive(config: Config, entry: Entry) -> bool:
    """Whether a config with the negative of a number is refused."""
    # An entry of a matrix and its mirror image may have any sign.
    if entry.value <= 0 or len(entry.paths) > 1:
        return False
    try:
        with_numbers(config, {entry.paths[0]: -entry.value})
    except ConfigError:
        return True
    return False


class FreeMotion:
    """The motion of a config as a function of x, from 0: relative changes of its free numbers.

    A number that must be positive is p exp(x), for the given p; another one p + |p| x.
    """

    def __init__(self, config: Config, entries: list[Entry], data: Measured) -> None:
        self.config, self.entries, self.data = config, entries, data
        self.parts = [(column.vector, column.axis) for column in data.columns]
        self.given = np.array([entry.value for entry in entries])
        self.positive = np.array([_is_positive(config, entry) for entry in entries])
        largest = np.nanmax(np.abs(data.values), axis=0)
        self.scatter = np.where(largest, largest, 1.0)

    def numbers(self, x: Array) -> tuple[Array, Array]:
        """Return the numbers at x, and their derivatives by x."""
        sizes = np.where(self.given, np.abs(self.given), 1.0)
        rates = sizes * np.exp(np.where(self.positive, x, 0.0))
        return np.where(self.positive, rates, self.given + sizes * x), rates

    def config_at(self, x: Array) -> Config:
        """Return the config with the numbers at x, validated."""
        pairs = zip(self.entries, self.numbers(x)[0].tolist(), strict=True)
        return with_numbers(self.config, {path: v for entry, v in pairs for path in entry.paths})

    def followed(self, config: Config) -> Any:
        """Return the `FollowedMotion` of a config at the measured times."""
        # Imported late: the engine must be installed.
        from rbstab.analysis.followed_motion import FollowedMotion

        return FollowedMotion(problem_of(config), self.data.times)

    def computed(self, x: Array) -> Array:
        """Return what is computed for the measured values, shape (n, m).

        Raises:
            UnfinishedRunError: The run did not complete; or another error of extreme numbers.
        """
        return self.followed(self.config_at(x)).values(self.parts)

    def residuals(self, x: Array) -> Array:
        """Return computed less measured in parts of the scatter; infinite if the run fails."""
        from rbstab.experiment.tuning.search import RUN_ERRORS

        try:
            return self._weighed(self.computed(x) - self.data.values)
        except RUN_ERRORS:
            return self._weighed(np.full(self.data.values.shape, np.inf))

    def jacobian(self, x: Array) -> Array:
        """Return the derivatives of the residuals by x, exact to round-off."""
        config, columns = self.config_at(x), []
        followed = self.followed(config)
        for entry, rate in zip(self.entries, self.numbers(x)[1].tolist(), strict=True):
            shifted = shifted_along(config, [(path, rate) for path in entry.paths])
            columns.append(self._weighed(followed.values(self.parts, shifted)))
        return np.stack(columns, axis=1)

    def _weighed(self, values: Array) -> Array:
        return (values / self.scatter)[np.isfinite(self.data.values)]
