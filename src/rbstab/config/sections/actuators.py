"""The motors of the stabilizers, a connector or a tie: a limit of their force, or a lag."""

from collections.abc import Callable
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, ValidationInfo

from rbstab.config.quantities import Diagonal, Positive, value_error
from rbstab.config.section import Section

ABSENT: Any = None
"""A key that need not be there; null is no value of it."""

LIMITED = {"H": ("K_t", "L_t"), "N": ("K_r", "L_r")}
"""The gains of each stabilizer that may have a limit."""

Law = Annotated[
    Literal["smooth", "hard"],
    Field(description="y/√(1 + (y/M)²) with the limit M, or y up to M: then it switches there"),
]


class Limits(Section):
    """The limits of the stabilizers."""

    H: Diagonal = Field(ABSENT, description="the largest force, by component, N, inertial")
    N: Diagonal = Field(ABSENT, description="the largest couple, by component, N m")


class Actuators(Section):
    """The motors of the stabilizers."""

    limit: Limits = Field(ABSENT, description="the largest H and N")
    axes: Literal["euler", "body"] = Field(
        "euler", description="the components of a limited N: on Euler angles (passive), or body"
    )
    law: Law = "smooth"
    lag: Positive = Field(ABSENT, description="time constant of H and N, s")


class TieActuators(Section):
    """The motors of a connector, or of a tie."""

    limit: Diagonal = Field(ABSENT, description="the largest force, by component, N, inertial")
    law: Law = "smooth"
    lag: Positive = Field(ABSENT, description="time constant of the force, s")


def _check(actuators: Any, data: dict[str, Any], limited: list[tuple[str, str]]) -> Any:
    if (actuators.limit is None) == (actuators.lag is None):
        both = "both limit and lag, which together are not shown to be passive"
        raise value_error(
            f"has {'neither limit nor lag' if actuators.lag is None else both}",
            "expected one of them",
        )
    if actuators.law == "hard" and not actuators.limit:
        raise value_error("has law: hard without a limit", "expected no law")
    for names in limited if actuators.limit else ():
        for name in names:
            # Where a gain is wrong, its own error is enough.
            gain = data.get(name, (1.0,))
            if isinstance(gain[0], tuple) or min(gain) <= 0:
                raise value_error(
                    f"has a limit, which acts along the axes of K, but {name} is not the diagonal "
                    "of a positive matrix",
                    f"expected three positive numbers for {' and '.join(names)}",
                )
    return actuators


def _check_controller(actuators: Actuators, info: ValidationInfo) -> Actuators:
    limit = actuators.limit
    limited = [gains for name, gains in LIMITED.items() if limit and getattr(limit, name)]
    if limit is not None and not limited:
        raise value_error("has a limit of nothing", "expected limit: {H: [...], N: [...]}")
    if actuators.axes == "body" and LIMITED["N"] not in limited:
        raise value_error("has axes: body without a limit of N", "expected axes: euler")
    if actuators.axes == "body" and actuators.law == "hard":
        raise value_error("has law: hard in body axes", "expected law: smooth, or axes: euler")
    return _check(actuators, info.data, limited)


def _check_tie(actuators: TieActuators, info: ValidationInfo) -> TieActuators:
    return _check(actuators, info.data, [("K_c", "L_c")])


def _check_embedded(actuators: TieActuators, info: ValidationInfo) -> TieActuators:
    if actuators.lag is not None:
        raise value_error(
            "has a lag beside the own state D, which together are not shown to be passive",
            "expected a smooth limit",
        )
    if actuators.law == "hard":
        raise value_error("has law: hard beside the own state D", "expected law: smooth")
    return _check_tie(actuators, info)


def _field(section: type[Section], check: Callable[..., Any]) -> tuple[Any, Any]:
    description = "motors with a limit, or a lag"
    return Annotated[section, AfterValidator(check)], Field(ABSENT, description=description)


OF_CONTROLLER = {"actuators": _field(Actuators, _check_controller)}
"""The field of the motors; it stands behind the gains, which it reads."""

_CHECKS = {"visco-elastic": _check_tie, "embedded": _check_embedded}

OF_TIES, OF_CONNECTORS = (
    {kind: {key: _field(TieActuators, check)} for kind, check in _CHECKS.items()}
    for key in ("actuators", "connector_actuators")
)
"""The fields of ties and connectors, by kind and variant."""
