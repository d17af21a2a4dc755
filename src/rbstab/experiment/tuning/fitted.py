"""The result of a fit: numbers with intervals, residuals, and what the data do not tell."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rbstab.config.files.measured import Measured
from rbstab.config.schema import Config
from rbstab.files.text import line
from rbstab.mechanics.numbers import Array

BELOW = 0.975
"""The probability that the true number is below the upper end of its 95 % interval."""

RANK = 1e-10
"""Singular values below this part of the largest are zero: the derivatives are exact to 1e-12."""

IN_NULL_SPACE = 1e-6
"""A number is in an undetermined combination if its entry of the unit vector is above this."""

WIDE = 1.0
"""A combination whose 95 % interval reaches farther than this, relatively, is hardly determined."""


Loose = tuple[Array, float]
"""A combination of numbers that the data do not determine, or hardly.

First the relative change of each number, the largest 1: together they change little. Then how far
the 95 % interval reaches along it, relatively; infinite if nothing changes.
"""

LEAST_SHOWN = 0.05
"""Smaller parts of a combination are not named."""

RANDOM = 3.0
"""Residuals are taken for random up to this many standard deviations of their autocorrelation."""


class FittedNumber(NamedTuple):
    """A number of a config, in its unit.

    Attributes:
        name: Its key.
        unit: Its unit.
        given: Its value in the given config.
        fitted: The fitted value.
        error: Its standard error; infinite if the data do not determine it.
        low: The lower end of its 95 % interval.
        high: The upper end.
    """

    name: str
    unit: str
    given: float
    fitted: float
    error: float
    low: float
    high: float


class FittedColumn(NamedTuple):
    """A measured column.

    Attributes:
        name: Its name.
        unit: Its SI unit.
        values: How many values it has.
        scatter: The standard deviation of its residuals.
        autocorrelation: The correlation of successive residuals; 0 if they are round-off.
    """

    name: str
    unit: str
    values: int
    scatter: float
    autocorrelation: float


@dataclass(frozen=True, eq=False, repr=False)
class Fitted:
    """The result of `fit`.

    Attributes:
        config: The config with the fitted numbers.
        measured: The measured motion: `times`, `columns` and `values`.
        numbers: The free numbers, with `given`, `fitted`, `error`, `low` and `high`.
        columns: The measured columns, with `values`, `scatter` and `autocorrelation`.
        computed: What the fitted config gives for the measured values, shape (n, m), SI.
        loose: The combinations of numbers that the data do not determine, or hardly: the relative
            change of each number, and how far the 95 % interval reaches along it (infinite: not
            determined).
        fallen: The names of numbers that fell to almost 0, and may not be less.
        is_minimum: Whether a minimum was found; if not, the numbers mean nothing.
    """

    config: Config
    measured: Measured
    numbers: tuple[FittedNumber, ...]
    columns: tuple[FittedColumn, ...]
    computed: Array
    loose: list[Loose]
    fallen: list[str]
    is_minimum: bool

    def __repr__(self) -> str:
        """Return one line: the fitted numbers with their intervals, if they mean anything."""
        if not self.is_minimum:
            return line("Fitted", self.config.title, ["no minimum was found"])
        intervals = (
            f"{number.name} {number.low:.4g} to {number.high:.4g}" for number in self.numbers
        )
        return line("Fitted", self.config.title, intervals)

    @property
    def residuals(self) -> Array:
        """What was measured less what is computed, shape (n, m), SI; NaN in gaps."""
        return self.measured.values - self.computed

    @property
    def warnings(self) -> list[str]:
        """What the data do not determine, and which residuals are not only noise: sentences."""
        sentences = []
        # A number that is 0 has no relative change: its interval says all.
        relative = [
            bool(number.given) and number.name not in self.fallen for number in self.numbers
        ]
        for changes, reach in self.loose:
            if reach < math.inf and not relative[changes.argmax()]:
                continue
            shown = [
                f"{number.name} {change:+.2g} %"
                if in_parts
                else f"{number.name} {change / 100 * (abs(number.given) or 1.0):+.2g} {number.unit}"
                for number, change, in_parts in zip(
                    self.numbers, changes.tolist(), relative, strict=True
                )
                if abs(change) >= LEAST_SHOWN
            ]
            how, extent = "not", "what was measured stays, to first order"
            if reach < math.inf:
                how, extent = "hardly", f"known to ±{100 * reach:.3g} times that"
            sentences.append(f"{how} determined: {', '.join(shown)}: {extent}")
        sentences += [
            f"{name}: fell to almost 0, and may not be less: its interval tells only how large it "
            "may be"
            for name in self.fallen
        ]
        sentences += [
            f"{column.name}: jumps by more than half a turn from one value to the next: angles are "
            "compared without whole turns taken off; if these were, put them back (numpy.unwrap)"
            for column, values in zip(self.measured.columns, self.measured.values.T, strict=True)
            if column.vector == "Theta"
            and (np.abs(np.diff(values[np.isfinite(values)])) > math.pi).any()
        ]
        sentences += [
            f"{column.name}: successive residuals are alike (autocorrelation "
            f"{column.autocorrelation:.2g}): the model misses something, or the errors of "
            "measurement are not independent; the intervals are too short"
            for column in self.columns
            if column.autocorrelation > RANDOM * column.values**-0.5
        ]
        return sentences


class Determined(NamedTuple):
    """What a linear model of the residuals tells of its numbers.

    Attributes:
        errors: The standard errors, shape (p,), infinite where a number is not determined.
        halves: Half the widths of the 95 % intervals, shape (p,).
        loose: The combinations that are not or hardly determined.
        decrement: The length of the Gauss-Newton step that remains, in standard errors.
        freedoms: How many residuals of each column are left over, shape (m,).
    """

    errors: Array
    halves: Array
    loose: list[Loose]
    decrement: float
    freedoms: Array


def determined(jacobian: Array, residuals: Array, columns: Array) -> Determined:
    """Return what is known of numbers from the singular value decomposition J = U S V'.

    The covariance is (J'J)⁻¹ = V S⁻² V', in the directions with S > 0. A column of n values has
    n - Σu² degrees of freedom, with its rows u of U. A variance is a sum of parts q_c, one from
    each column with ν_c degrees of freedom, so its t quantile has (Σ q_c)²/Σ(q_c²/ν_c) of them.

    Args:
        jacobian: The derivatives of the residuals by the numbers, each in parts of its size, shape
            (n, p) with n >= p.
        residuals: In standard deviations of the measurement, shape (n,).
        columns: The column of each residual, counted from 0, shape (n,).

    Source: F. E. Satterthwaite, Biometrics Bull. 2 (1946) 110-114.
    """
    from scipy.special import stdtrit

    U, s, Vt = np.linalg.svd(jacobian, full_matrices=False)
    kept = s > RANK * s[0]
    place = columns == np.arange(columns.max() + 1)[:, None]
    freedoms = place.sum(axis=1) - place @ (U[:, kept] ** 2).sum(axis=1)

    def reach(parts: Array) -> Array:
        total = parts.sum(axis=0)
        freedom = total**2 / (parts**2 / freedoms[:, None]).sum(axis=0)
        half_widths: Array = stdtrit(freedom, BELOW) * np.sqrt(total)
        return half_widths

    inverse = U[:, kept] / s[kept]
    parts = place @ (inverse @ Vt[kept]) ** 2
    unknown = (np.abs(Vt[~kept]) > IN_NULL_SPACE).any(axis=0)
    errors = np.where(unknown, math.inf, np.sqrt(parts.sum(axis=0)))
    with np.errstate(all="ignore"):
        halves = np.where(unknown, math.inf, reach(parts))
    reaches = np.full(len(s), math.inf)
    reaches[kept] = reach(place @ inverse**2)
    loose = [
        (row / row[np.abs(row).argmax()], far * float(np.abs(row).max()))
        for far, row in zip(reaches.tolist(), Vt, strict=True)
        if far > WIDE
    ]
    decrement = float(np.linalg.norm(U[:, kept].T @ residuals))
    return Determined(errors, halves, loose, decrement, freedoms)
