"""The largest tolerance of a key, in percent, for which the proof for all bodies succeeds."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction

from rbstab.config.errors import ConfigError
from rbstab.config.schema import Config
from rbstab.config.tolerances import Tolerance, decimal_text, tolerances_of
from rbstab.experiment.robust.record import BodiesRecord

FIRST = Fraction(1)
"""%: the first percentage that is tried. It is doubled or halved until the answer changes."""

LEAST, HIGHEST = Fraction(1, 64), Fraction(1024)
"""%: smaller and larger percentages are not tried."""

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


def largest_within(
    config: Config,
    prove: Callable[[Sequence[Tolerance]], BodiesRecord],
    key: str,
    fixed: Sequence[str],
    is_late: Callable[[], bool] = lambda: False,
) -> Largest:
    """Return the largest percentage p such that KEY=±p% is proved, by bisection to 1 % of p.

    A smaller box is part of a larger one. So if a percentage is not proved, no larger one is tried.

    Args:
        config: The config.
        prove: Proves tolerances of it.
        key: The key.
        fixed: The texts of other tolerances, which stay.
        is_late: Returns whether no further percentage is to be tried.
    """
    low: Fraction | None = None
    high: Fraction | None = None
    best = failed = None
    percent, late = FIRST, False
    while LEAST <= percent <= HIGHEST and not (late := is_late()):
        texts = [*fixed, f"{key}=±{decimal_text(percent)}%"]
        try:
            record = prove(tolerances_of(config, texts))
        except ConfigError:
            record = None
        if record is not None and record.proved:
            low, best = percent, record
        else:
            high, failed = percent, record
        if low is None or high is None:
            percent = percent * 2 if high is None else percent / 2
            continue
        percent = Fraction(f"{float((low + high) / 2):.{DIGITS}g}")
        if high - low <= low / 100 or not low < percent < high:
            break
    return Largest(key, low, best, high, failed, late)
