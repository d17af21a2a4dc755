"""The paper's cases as it prints them, and the keys in which a config differs from its case.

A value printed for a case says nothing about a run of another body, other gains, or another start.
"""

from collections.abc import Mapping
from typing import Any

from rbstab.config.schema import Config
from rbstab.report.runs.config_tables import flat

_COMMON: dict[str, Any] = {
    "body.mass": 41.0,
    "body.inertia": [10.0, 8.0, 0.4],
    "body.contact_point": [0.15, 0.1, -0.42],
    "gravity": [0.0, 0.0, 0.0],
    "controller.K_t": [4100.0, 4100.0, 3280.0],
    "controller.L_t": [200.0, 200.0, 140.0],
    "controller.K_r": [400.0, 400.0, 320.0],
    "controller.L_r": [60.0, 60.0, 42.0],
    "controller.anchor": "origin",
    "initial.orientation": [0.0, 0.0, 0.0],
    "initial.angular_velocity": [16.0, 32.0, -16.0],
    "integration.duration": 2.0,
}
_AT_ORIGIN: dict[str, Any] = {
    "initial.position": [0.0, 0.0, 0.0],
    "initial.velocity": [0.0, 0.0, 0.0],
}

CASES: dict[str, dict[str, Any]] = {
    "paper, section 6.1": _COMMON
    | {"controller.variant": "permanent", "controller.L_t": [210.0, 210.0, 140.0]},
    "paper, section 6.2": _COMMON | _AT_ORIGIN | {"controller.variant": "visco-elastic"},
    "paper, section 6.3": _COMMON
    | _AT_ORIGIN
    | {
        "controller.variant": "embedded",
        "controller.K_c": [12300.0, 12300.0, 9840.0],
        "controller.L_c": [600.0, 600.0, 420.0],
        "controller.K_d": [12300.0, 12300.0, 9840.0],
        "controller.L_d": [1200.0, 1200.0, 840.0],
        "initial.connector_state": [0.0, 0.0, 0.0],
    },
}
"""The config of each case, by the source that a `reference` names."""

NOT_PRINTED = {"paper, section 6.2": ("controller.K_c", "controller.L_c")}
"""Keys that a case needs and the paper does not print: any value of them is of the case."""


def changed_keys(config: Config, data: Mapping[str, Any]) -> dict[str, tuple[Any, Any]]:
    """Return the keys in which a config differs from the case of the paper that it refers to.

    A barrier is not compared if the config prints no values: its note says what it adds.

    Args:
        config: The config.
        data: The same as it is stored, with all defaults.

    Returns:
        The value of the config and the paper's value, by key; None where a key is missing. It is
        empty for a source that is not a case of the paper: its config is not known.
    """
    reference = config.reference
    case = CASES.get(reference.source) if reference is not None else None
    if reference is None or case is None:
        return {}
    has_values = (reference.final, reference.peak_contact_displacement) != (None, None)
    own = {
        key: value
        for key, value in flat(data).items()
        if _acts(key) and (has_values or not key.startswith("elements."))
    }
    free = NOT_PRINTED.get(reference.source, ())
    return {
        key: (own.get(key), case.get(key))
        for key in dict.fromkeys((*case, *own))
        if key not in free and _plain(own.get(key)) != _plain(case.get(key))
    }


def _acts(key: str) -> bool:
    """Whether a key is part of the experiment; how it is integrated and called is not."""
    return key == "integration.duration" or key.partition(".")[0] not in ("title", "integration")


def _plain(value: Any) -> Any:
    """Return a diagonal matrix as its diagonal, and other values as they are."""
    if isinstance(value, list) and all(isinstance(row, list) for row in value):
        diagonal = [row[k] for k, row in enumerate(value) if k < len(row)]
        others = [x for k, row in enumerate(value) for j, x in enumerate(row) if j != k]
        return value if any(others) else diagonal
    return value
