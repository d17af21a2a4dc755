"""Unknown keys of a config: which key was likely meant, and what it means here."""

from collections.abc import Iterable, Iterator, Mapping
from difflib import SequenceMatcher
from functools import cache
from types import MappingProxyType
from typing import Any, get_args

from pydantic import BaseModel

from rbstab.config.errors import closest, closest_keys, did_you_mean, folded, keys_named
from rbstab.config.schema import NO_VARIANT, VARIANTS, model_of
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


def unknown_key(location: Path, path: Path, model: type[BaseModel]) -> tuple[str, str]:
    """Return the problem of an unknown key of a config, and what is expected.

    Args:
        location: The path of the key in the models, with the words that choose one of several.
        path: Its path in the config.
        model: The model of the config.
    """
    key, known = str(path[-1]), _descriptions(_models_at(model, location[:-1]))
    if path[0] == "elements":
        return with_hint(key, known)
    others = {name: _models_at(model_of(name), path[:-1]) for name in VARIANTS}
    owners = [name for name, models in others.items() if key in _descriptions(models)]
    if owners:
        variant = next((name for name in VARIANTS if model_of(name) is model), NO_VARIANT)
        instead = "; here, `elements` hold the body" if variant == NO_VARIANT else ""
        problem = f"is not a key of the variant {variant}"
        return problem, f"it belongs to {', '.join(owners)}{instead}"
    return with_hint(key, known, dict(_dotted_keys(model)) | keys_of_variants())


def with_hint(
    key: str, known: Mapping[str, str], elsewhere: Mapping[str, str] = MappingProxyType({})
) -> tuple[str, str]:
    """Return the problem of an unknown key, with what is expected.

    A hint to a key that may have another meaning says what ours means: twice the toe_strain of a
    ligament is the transition_strain of other programs.

    Args:
        key: The key.
        known: The descriptions of the keys that may stand there.
        elsewhere: Those of dotted keys of other sections.
    """
    near = closest(key, known)
    meant = _named(key, known)[:1] or _named(key, elsewhere)
    meant = meant or ([near] if near is not None else closest_keys(key, elsewhere))
    if not meant:
        return "is unknown", f"expected one of {', '.join(known)}" if known else "expected no key"
    description = {**elsewhere, **known}[meant[0]] if len(meant) == 1 else ""
    return "is unknown", did_you_mean(meant) + _meaning(key, meant[0], description)


def keys_like(key: str) -> list[str]:
    """Return the keys of configs that a key of an unknown section may mean; the closest ones."""
    return _named(key, keys_of_variants()) or closest_keys(key, keys_of_variants())


def _named(key: str, keys: Iterable[str]) -> list[str]:
    """Return the keys with this last name, or with that of which another program has this one."""
    names = (key, *FOREIGN.get(folded(key), ()))
    return next(filter(None, (keys_named(name, keys) for name in names)), [])


def words_at(model: type[BaseModel], location: Path, key: str) -> list[str]:
    """Return the words of a key that chooses one of the models at a place."""
    fields = [one.model_fields[key] for one in _models_at(model, location)]
    return list(dict.fromkeys(word for field in fields for word in get_args(field.annotation)))


@cache
def keys_of_variants() -> dict[str, str]:
    """Return the keys of the configs of all variants, with their descriptions."""
    return {key: text for variant in VARIANTS for key, text in _dotted_keys(model_of(variant))}


def _meaning(key: str, ours: str, description: str) -> str:
    """Return a sentence on what our key means; empty if the other one is only misspelt."""
    a, b = folded(key), folded(ours.rpartition(".")[2])
    misspelt = b.startswith(a) or SequenceMatcher(None, a, b).ratio() >= MISSPELT
    return "" if misspelt or not description else f" Here it is {description.removesuffix(', 1')}"


def _dotted_keys(model: type[BaseModel], above: str = "") -> Iterator[tuple[str, str]]:
    """Yield the keys of a config with their descriptions, without those that are rarely meant."""
    for name, field in model.model_fields.items():
        if name in ("elements", "reference"):
            continue
        yield f"{above}{name}", field.description or ""
        for section in models_of(model, name):
            yield from _dotted_keys(section, f"{above}{name}.")


def _descriptions(models: list[type[BaseModel]]) -> dict[str, str]:
    """Return the keys that the schema allows in a mapping, with their descriptions."""
    fields = [item for model in models for item in model.model_fields.items()]
    return dict(sorted((field.alias or name, field.description or "") for name, field in fields))


def _models_at(model: type[BaseModel], location: Path) -> list[type[BaseModel]]:
    """Return the models that may stand at a place."""
    models = [model]
    # The name of an element is no key of a model.
    for part in (*location[:1], *location[1 + (location[:1] == ("elements",)) :]):
        inner = [child for owner in models for child in models_of(owner, part)]
        models = inner or [one for one in models if _is_chosen(one, part)]
    return models


def _is_chosen(model: type[BaseModel], word: str | int) -> bool:
    """Whether a word chooses this model among others."""
    return any(word in get_args(field.annotation) for field in model.model_fields.values())


def models_of(owner: type[BaseModel], key: str | int) -> Iterator[type[BaseModel]]:
    """Yield the models of a field, which its value may be, also those of its input only."""
    field = owner.model_fields.get(str(key))
    candidates: list[Any] = []
    if field is not None:
        # A validator may take a mapping in place of the value, such as {deg: [0, 10, 0]}.
        inputs = [getattr(data, "json_schema_input_type", None) for data in field.metadata]
        candidates = [field.annotation, *inputs]
    while candidates:
        candidate: Any = candidates.pop(0)
        if isinstance(candidate, type) and issubclass(candidate, BaseModel):
            yield candidate
        candidates += getattr(candidate, "__args__", ())
