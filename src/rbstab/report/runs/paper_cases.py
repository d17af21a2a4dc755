"""The paper's cases, and the keys in which a config differs from its case.

A value printed for a case says nothing about a run of another body, other gains, or another start.
"""

from collections.abc import Mapping
from functools import cache
from typing import Any

from rbstab.config.load import load_config
from rbstab.config.schema import Config
from rbstab.packaged.examples import example
from rbstab.report.runs.config_tables import flat

CASES = {
    "paper, section 6.1": "paper/case1_permanent",
    "paper, section 6.2": "paper/case2_visco_elastic",
    "paper, section 6.3": "paper/case3_embedded",
}
"""The example that is a case of the paper, by the source that a `reference` names."""

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
    if reference is None or reference.source not in CASES:
        return {}
    case = _keys_of(CASES[reference.source])
    has_values = (reference.final, reference.peak_contact_displacement) != (None, None)
    config_values = {
        key: value
        for key, value in flat(data).items()
        if _acts(key) and (has_values or not key.startswith("elements."))
    }
    free = NOT_PRINTED.get(reference.source, ())
    return {
        key: (config_values.get(key), case.get(key))
        for key in dict.fromkeys((*case, *config_values))
        if key not in free and _plain(config_values.get(key)) != _plain(case.get(key))
    }


@cache
def _keys_of(name: str) -> dict[str, Any]:
    """Return the keys of an example that are part of the experiment."""
    data = load_config(example(name)).model_dump(mode="json", exclude_none=True)
    return {key: value for key, value in flat(data).items() if _acts(key)}


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
