"""Unknown keys of a config: which key was likely meant, and what it means here."""

from collections.abc import Iterable, Iterator
from difflib import SequenceMatcher
from functools import cache
from typing import Any

from pydantic import BaseModel

from rbstab.config.errors import closest, closest_keys, did_you_mean, folded, keys_named
from rbstab.config.schema import NO_VARIANT, VARIANTS
from rbstab.config.source import Path

MISSPELT = 0.8
"""Two words that are less similar (0 to 1) may have different meanings."""

_LENGTH = ("slack_length", "rest_length")
_CENTRE = ("contact_point",)

FOREIGN: dict[str, tuple[str, ...]] = {
    # OpenSim
    "transitionstrain": ("toe_strain",),
    "linearstiffness": ("stiffness",),
    "restinglength": _LENGTH,
    "masscenter": _CENTRE,
    # URDF, SDF and MuJoCo
    "com": _CENTRE,
    "centerofmass": _CENTRE,
    "centreofmass": _CENTRE,
    "rpy": ("orientation",),
    "euler": ("orientation",),
    "quat": ("quaternion", "orientation"),
    "quaternion": ("orientation",),
    "fullinertia": ("inertia",),
    "diaginertia": ("inertia",),
    "springlength": _LENGTH,
    "timestep": ("samples",),
    # MATLAB and others
    "attitude": ("orientation",),
    "tilt": ("within",),
    "tolerance": ("rtol", "within"),
    "naturallength": _LENGTH,
    "freelength": _LENGTH,
    "springconstant": ("stiffness",),
    "springrate": ("stiffness",),
    "dampingcoefficient": ("damping",),
    "omega": ("angular_velocity",),
    "tspan": ("duration",),
    "stoptime": ("duration",),
    "dt": ("samples",),
}
"""Names that other programs have for something similar, folded, and our keys in their place."""


def unknown_key(path: Path, model: type[BaseModel]) -> tuple[str, str]:
    """Return the problem of an unknown key of a config, and what is expected."""
    key, known = str(path[-1]), _keys_at(model, path[:-1])
    owners = [name for name, other in VARIANTS.items() if key in _keys_at(other, path[:-1])]
    if owners:
        variant = next((name for name, other in VARIANTS.items() if other is model), NO_VARIANT)
        instead = "; here, `elements` hold the body" if variant == NO_VARIANT else ""
        problem = f"is not a key of the variant {variant}"
        return problem, f"it belongs to {', '.join(owners)}{instead}"
    here = keys_named(key, known)
    elsewhere = _keys_named(key, model) if not here else []
    if not here and not elsewhere and _meant(key, known) is None:
        elsewhere = keys_like(key, model)
    if elsewhere:
        *section, name = elsewhere[0].split(".")
        known = _keys_at(model, tuple(section))
        meaning = _meaning(key, name, known.get(name, "")) if len(elsewhere) == 1 else ""
        return "is unknown", did_you_mean(elsewhere) + meaning
    return with_hint(key, known)


def keys_like(key: str, *first: type[BaseModel]) -> list[str]:
    """Return the keys of configs that a key of an unknown section may mean; the closest ones.

    Args:
        key: The wrong key.
        first: The model of the config; its own keys come before those of other variants.
    """
    own = [name for model in first for name in _dotted_keys(model)]
    names = (key, *FOREIGN.get(folded(key), ()))
    named = next(filter(None, (_keys_named(name, *first) for name in names)), [])
    return named or closest_keys(key, own) or closest_keys(key, keys_of_variants())


def _keys_named(key: str, *first: type[BaseModel]) -> list[str]:
    """Return the keys of configs in any section with this name, as `keys_like`."""
    own = [name for model in first for name in _dotted_keys(model)]
    return keys_named(key, own) or keys_named(key, keys_of_variants())


@cache
def keys_of_variants() -> list[str]:
    """Return the keys of the configs of all variants."""
    return list(dict.fromkeys(key for model in VARIANTS.values() for key in _dotted_keys(model)))


def _meant(key: str, known: Iterable[str]) -> str | None:
    """Return the known key that an unknown one most likely means, or None."""
    names = [name for name in FOREIGN.get(folded(key), ()) if name in known]
    return names[0] if names else closest(key, known)


def with_hint(key: str, known: dict[str, str]) -> tuple[str, str]:
    """Return the problem of an unknown key, with what is expected.

    A hint to a key that may have another meaning says what ours means: twice the toe_strain of a
    ligament is the transition_strain of other programs.

    Args:
        key: The key.
        known: The descriptions of the keys that may stand there.
    """
    close = _meant(key, known)
    if close is not None:
        return "is unknown", did_you_mean([close]) + _meaning(key, close, known[close])
    return "is unknown", f"expected one of {', '.join(known)}" if known else "expected no key"


def _meaning(key: str, ours: str, description: str) -> str:
    """Return a sentence on what our key means; empty if the other one is only misspelt."""
    a, b = folded(key), folded(ours)
    misspelt = b.startswith(a) or SequenceMatcher(None, a, b).ratio() >= MISSPELT
    return "" if misspelt or not description else f" Here it is {description.removesuffix(', 1')}"


def _dotted_keys(model: type[BaseModel], above: str = "") -> Iterator[str]:
    """Yield the keys of a config as dotted texts, without those that are rarely meant."""
    for name in model.model_fields:
        if name in ("elements", "reference"):
            continue
        yield f"{above}{name}"
        for section in models_of(model, name):
            yield from _dotted_keys(section, f"{above}{name}.")


def _keys_at(model: type[BaseModel], path: Path) -> dict[str, str]:
    """Return the keys that the schema allows in the mapping at a path, with their descriptions."""
    models = [model]
    for part in path:
        models = [child for owner in models for child in models_of(owner, part)]
    fields = [item for owner in models for item in owner.model_fields.items()]
    return dict(sorted((name, field.description or "") for name, field in fields))


def models_of(owner: type[BaseModel], key: str | int) -> Iterator[type[BaseModel]]:
    """Yield the models of a field, which its value may be, also those of its input only."""
    field = owner.model_fields.get(str(key))
    candidates: list[Any] = []
    if field is not None:
        # A validator may take a mapping in place of the value, such as {deg: [0, 10, 0]}.
        inputs = [getattr(data, "json_schema_input_type", None) for data in field.metadata]
        candidates = [field.annotation, *inputs]
    while candidates:
        candidate: Any = candidates.pop()
        if isinstance(candidate, type) and issubclass(candidate, BaseModel):
            yield candidate
        candidates += getattr(candidate, "__args__", ())
