"""The largest tolerance of a key, in percent, for which the proof for all bodies succeeds."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction

from rbstab.config.errors import ConfigError
from rbstab.config.schema import Config
from rbstab.config.tolerances import decimal_text, tolerances_of
from rbstab.experiment.robust.record import BodiesRecord

FIRST = Fraction(1)
"""%: the first percentage that is tried. It is doubled or halved until the answer changes."""

LEAST = Fraction(1, 64)
"""%: smaller percentages are not tried."""

HIGHEST = Fraction(1024)
"""%: larger percentages are not tried."""

DIGITS = 3
"""The number of significant digits of a percentage that is tried."""


@dataclass(frozen=True)
class Largest:
    """The result of a bisection on the percentage of a key.

    Args:
        key: The key.
        percent: The largest percentage that is proved; None if none is.
        record: Its proof; None if no percentage is proved.
        not_proved: The smallest percentage that was tried and is not proved; None if there is none.
        why: The proof that failed there; None if the bounds of that percentage are not valid.
        late: Whether a limit of time ended the bisection.
    """

    key: str
    percent: Fraction | None
    record: BodiesRecord | None
    not_proved: Fraction | None
    why: BodiesRecord | None
    late: bool = False


Prove = Callable[[Sequence[str]], BodiesRecord | None]
"""A function that proves the tolerances of some texts; None if their bounds are not valid."""


def proving(config: Config, prove: Callable[..., BodiesRecord]) -> Prove:
    """Return the function for `largest_within` that reads and proves tolerances of a config.

    Args:
        config: The config.
        prove: Proves a list of `Tolerance`.
    """

    def proved(texts: Sequence[str]) -> BodiesRecord | None:
        try:
            tolerances = tolerances_of(config, texts)
        except ConfigError:
            return None
        return prove(tolerances)

    return proved


def largest_within(
    prove: Prove, key: str, fixed: Sequence[str], is_late: Callable[[], bool] = lambda: False
) -> Largest:
    """Return the largest percentage p such that KEY=±p% is proved, by bisection to 1 % of p.

    A smaller box is part of a larger one. So if a percentage is not proved, no larger one is tried.

    Args:
        prove: Proves the tolerances of some texts.
        key: The key.
        fixed: The texts of other tolerances, which stay.
        is_late: Returns whether no further percentage is to be tried.
    """
    low: Fraction | None = None
    high: Fraction | None = None
    best: BodiesRecord | None = None
    failed: BodiesRecord | None = None
    percent = FIRST
    while LEAST <= percent <= HIGHEST:
        if is_late():
            return Largest(key, low, best, high, failed, late=True)
        record = prove([*fixed, f"{key}=±{decimal_text(percent)}%"])
        if record is not None and record.proved:
            low, best = percent, record
        else:
            high, failed = percent, record
        if low is not None and high is not None and high - low <= low / 100:
            break
        if low is None or high is None:
            percent = percent * 2 if high is None else percent / 2
            continue
        middle = _rounded((low + high) / 2)
        if not low < middle < high:
            break
        percent = middle
    return Largest(key, low, best, high, failed)


def _rounded(number: Fraction) -> Fraction:
    """Return a number with `DIGITS` significant digits."""
    return Fraction(f"{float(number):.{DIGITS}g}")
