"""The signals of inputs in the config schema, one model for each kind."""

from functools import reduce
from itertools import pairwise
from math import inf
from operator import or_
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator

from rbstab.config.errors import entries
from rbstab.config.quantities import NotNegative, Positive, Real, Text, value_error, whole
from rbstab.config.section import Section, required
from rbstab.config.sections.angles import OR_ANGLE_IN_DEGREES

MAX_ROWS = 10_000
"""The most rows of a table."""

MAX_KNOTS = 100_000
"""The most values of a noise in a run."""

MAX_SEED = 2**53
"""Seeds are below this: so each is exact as a float too, which a plan varies."""


def _check_list(value: Any) -> Any:
    # Otherwise pydantic would accept a set, whose order is arbitrary.
    if not isinstance(value, list | tuple):
        raise value_error("is not a list", "expected a list of numbers")
    if not value:
        raise value_error("is empty", "expected at least one number")
    if len(value) > MAX_ROWS:
        raise value_error(f"has {len(value)} entries", f"expected at most {MAX_ROWS}")
    return value


Seed = Annotated[int, Field(ge=0, lt=MAX_SEED), BeforeValidator(whole)]

Numbers = Annotated[
    tuple[Real, ...], Field(min_length=1, strict=False), BeforeValidator(_check_list)
]


class ConstantSignal(Section):
    """The signal is 1."""

    kind: Literal["constant"] = required("the kind of signal")


class SineSignal(Section):
    """The signal is sin(2πft + φ)."""

    kind: Literal["sine"] = required("the kind of signal")
    frequency: Positive = required("f, Hz")
    phase: Annotated[Real, OR_ANGLE_IN_DEGREES] = Field(0.0, description="φ, rad, or {deg: 90}")


class PulseSignal(Section):
    """The signal is 1 for a while, and 0 before and after it."""

    kind: Literal["pulse"] = required("the kind of signal")
    start: NotNegative = required("when it becomes 1, s")
    duration: Positive = required("for how long it is 1, s")


class RampSignal(Section):
    """The signal rises from 0 to 1, and stays there."""

    kind: Literal["ramp"] = required("the kind of signal")
    start: NotNegative = required("when it begins to rise, s")
    duration: Positive = required("how long it rises, s")


class TableSignal(Section):
    """The signal is given by values at some times, with straight lines between them."""

    kind: Literal["table"] = required("the kind of signal")
    file: Text | None = Field(
        None, description="a CSV file of times, s, and values, beside the config; or else:"
    )
    times: Numbers | None = Field(None, validate_default=True, description="ascending, s")
    values: Numbers | None = Field(None, validate_default=True, description="one for each time")
    source: Text | None = Field(None, description="where the numbers are from; it has no effect")

    @field_validator("times")
    @classmethod
    def _check_times(cls, times: Any, info: ValidationInfo) -> Any:
        file = info.data.get("file")
        if times is None:
            raise value_error("is missing", "expected file, or times and values")
        if file is not None:
            raise value_error("is given beside a file", "expected file, or times and values")
        if any(b < a for a, b in pairwise(times)):
            raise value_error("is not ascending", "expected times that do not fall")
        return times

    @field_validator("values")
    @classmethod
    def _check_values(cls, values: Any, info: ValidationInfo) -> Any:
        times = info.data.get("times")
        if times is None:
            return values  # the times have the problem already
        if values is None:
            raise value_error("is missing", "expected one value for each time")
        if len(values) != len(times):
            raise value_error(f"has {entries(values)}", f"expected {len(times)}, as times has")
        return values


class NoiseSignal(Section):
    """The signal is a random process with mean 0 and standard deviation 1."""

    kind: Literal["noise"] = required("the kind of signal")
    seed: Seed = required("equal seeds give equal noise")
    rate: Positive = required("random values per second, with straight lines between them, 1/s")
    correlation_time: Positive = required("T of the correlation e^(-|τ|/T), s")


SIGNALS: dict[str, type[Section]] = {
    "constant": ConstantSignal,
    "sine": SineSignal,
    "pulse": PulseSignal,
    "ramp": RampSignal,
    "table": TableSignal,
    "noise": NoiseSignal,
}
"""The model of each kind of signal."""

SMOOTH_SIGNALS = ("constant", "sine")
"""The kinds that are smooth at all times; the others are made of legs."""


def extremes(signal: Any) -> tuple[float, ...]:
    """Return numbers among which are the smallest and the largest value of a signal."""
    by_kind = {"constant": (1.0,), "sine": (-1.0, 1.0), "pulse": (0.0, 1.0), "ramp": (0.0, 1.0)}
    unbounded = (-inf, inf)
    return getattr(signal, "values", None) or by_kind.get(signal.kind, unbounded)


SIGNAL_UNITS = {
    "frequency": "Hz",
    "phase": "rad",
    "start": "s",
    "duration": "s",
    "times": "s",
    "values": "1",
    "seed": "1",
    "rate": "1/s",
    "correlation_time": "s",
}
"""The units of the keys with numbers."""


Signal: Any = Annotated[
    reduce(or_, SIGNALS.values()),
    Field(
        discriminator="kind",
        description="how the load changes with time: it is amplitude times signal",
    ),
]
