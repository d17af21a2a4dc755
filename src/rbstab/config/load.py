"""Loading a config from a file or plain data, and writing it as plain data."""

import hashlib
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from os import PathLike
from pathlib import Path as FilePath
from typing import Any

from pydantic import ValidationError

from rbstab.config.errors import ConfigError, ConfigProblem, Location, closest, describe, hint
from rbstab.config.files.named_files import embed_files
from rbstab.config.messages import problems_of
from rbstab.config.numbers import replaced
from rbstab.config.overrides import override
from rbstab.config.schema import (
    NO_VARIANT,
    VARIANTS,
    Config,
    Experiment,
    model_of,
    variant_of,
)
from rbstab.config.source import MAX_DEPTH, TOO_DEEP, Path, Source, read_source
from rbstab.config.user_code.check import check_code
from rbstab.config.user_code.permission import Code, may_run_code, without_code
from rbstab.config.user_code.section import ALLOW, PARAMETERS
from rbstab.config.user_code.section import KIND as PYTHON
from rbstab.elements.declarations import is_initial
from rbstab.mechanics.states import PITCH

VARIANT = "controller.variant"

FALLBACK_VARIANT = "visco-elastic"
"""The variant used to check the common keys of a config whose variant is unknown."""

VARIANT_SECTIONS = ("controller", "initial", "integration")
"""The sections whose keys depend on the variant."""

IN_VARIANT_SECTIONS = tuple(f"{section}." for section in VARIANT_SECTIONS)

PLAN_ONLY = {"base", "vary"}
"""The keys that show that a document is the plan of a sweep, valid or not."""

NO_DIRECTION = (
    "expected another point or anchor, another start, rest_length: 0 without damping, or kind: "
    "visco-elastic, which damps all directions"
)
"""What is expected of a spring that has no length at the start."""

WANTED = ("desired", "bound")
"""The sections on which no motion depends."""

SCIPY_ONLY = ("method", "atol")
"""Integration keys that only the engine scipy uses."""


def load_config(
    config: str | FilePath | Mapping[str, Any] | Config,
    changes: Iterable[str] = (),
    *,
    allow_python: bool = False,
) -> Config:
    """Load and validate a config.

    Args:
        config: The path of a YAML file, a dictionary with the same keys, or a loaded config that
            is to be changed. In a dictionary, the files of users' elements are relative to the
            working directory. A loaded config keeps its `allow_python`.
        changes: Strings `key=value` that replace single values, as `--set` does.
        allow_python: Whether the files of users' elements (`kind: python`) may be run. They run
            with all your rights. Without it, a config with such an element is refused.

    Returns:
        The config, immutable, with all defaults. Values have SI units and radians.

    Raises:
        ConfigError: The config is invalid. The error has all problems, each as
            `file:line:column: key: what is wrong (what was expected)`.
    """
    changes = [changes] if isinstance(changes, str) else list(changes)
    if isinstance(config, Experiment):
        if not changes and not allow_python:
            return config
        allow_python = allow_python or may_run_code(config)
        config = config.plain()
    source = _changed_source(config, changes)
    loaded_config = loaded(source, Code.ALLOWED if allow_python else Code.REFUSED)
    _check_lengths(loaded_config, source)
    return loaded_config


def config_to_read(
    config: str | FilePath | Mapping[str, Any], changes: Iterable[str] = ()
) -> Config:
    """Load and validate a config to read it; it cannot be run if it has elements of users.

    Raises:
        ConfigError: As `load_config`.
    """
    changes = [changes] if isinstance(changes, str) else changes
    return loaded(_changed_source(config, changes), Code.NOT_RUN)


def loaded(source: Source, code: Code) -> Config:
    """Return the config of a source into which its files were read.

    Args:
        source: The source.
        code: What becomes of the code of users.

    Raises:
        ConfigError: As `load_config`.
    """
    config = validated(source, allow_python=code is Code.ALLOWED)
    if code is not Code.NOT_RUN:
        check_code(config, source, allow_python=code is Code.ALLOWED)
    return config


def _check_lengths(config: Config, source: Source) -> None:
    """Refuse a config with a spring whose line has no direction at the start."""
    if not any(section.kind == "spring" for section in config.elements.values()):
        return
    # Imported late: few configs have springs, and building one needs its equations.
    from rbstab.config.build import springs_without_length

    problems = []
    for name, length in springs_without_length(without_code(config)).items():
        problem = (
            f"is on the anchor at the start ({length:.3g} m from it): the line has no direction"
        )
        problems.append(source.problem(("elements", name, "point"), problem, NO_DIRECTION))
    if problems:
        raise ConfigError(problems)


def _changed_source(config: str | FilePath | Mapping[str, Any], changes: Iterable[str]) -> Source:
    source = source_of(config)
    if not PLAN_ONLY.isdisjoint(source.data):
        expected = "expected a config; rbstab.load_plan loads a plan, and `rbstab sweep` runs it"
        raise ConfigError([source.problem((), "is the plan of a sweep", expected)])
    override(source, changes)
    embed_files(source)
    return source


def changed_config(config: Config, data: Mapping[str, Any]) -> Config:
    """Validate changed data of a config; code of users may run if it may in the config.

    Args:
        config: The config.
        data: Its plain data with changes, which must not be of the elements' code.

    Raises:
        ConfigError: As `load_config`.
    """
    return validated(source_of(data), allow_python=may_run_code(config))


def with_numbers(config: Config, numbers: Mapping[Path, float]) -> Config:
    """Return the config with some of its numbers replaced, validated.

    Raises:
        ConfigError: It is not valid.
        LookupError: There is no such path.
    """
    return changed_config(config, replaced(resolved(config), numbers))


def source_of(
    document: str | FilePath | Mapping[str, Any] | Source, name: str = "config"
) -> Source:
    """Read a document that must be a mapping, from a YAML file or plain data.

    Args:
        document: The path of the file, the data, or what was read already.
        name: The source name of plain data in messages.

    Raises:
        ConfigError: The document cannot be read, or is not a mapping.
        TypeError: It is none of these.
    """
    if isinstance(document, Source):
        source = document
    elif isinstance(document, Mapping):
        source = Source(_plain_data(document, MAX_DEPTH), {(): Location(name)})
    elif isinstance(document, str) and "\n" in document:
        problem = "is a text that looks like YAML, and not the path of a file"
        expected = "expected the path of a YAML file, or a dictionary, as from yaml.safe_load(text)"
        raise ConfigError.at(Location(name), problem, expected)
    elif isinstance(document, str | PathLike):
        source = read_source(FilePath(document))
    else:
        raise TypeError(
            f"the {name} is {describe(document)} (expected the path of a YAML file, a dictionary "
            f"with the same keys, or a loaded {name})"
        )
    if source.data is None:
        source.data = {}  # then the required keys of an empty file are reported as missing
    if not isinstance(source.data, dict):
        raise ConfigError([source.problem((), f"is {describe(source.data)}", "expected a mapping")])
    return source


def validated(source: Source, *, allow_python: bool = False) -> Config:
    """Validate a source and return its config; no code of a user runs.

    Args:
        source: The source; the files of users' elements were read into it (`embed_files`).
        allow_python: Whether these files may be run, when the system of the config is built.

    Raises:
        ConfigError: As `load_config`.
    """
    variant = variant_of(source.data)
    is_variant = variant in (*VARIANTS, NO_VARIANT)
    # By a misspelt variant the other keys can be judged too.
    meant = closest(variant, VARIANTS) if isinstance(variant, str) and not is_variant else None
    model = model_of(variant if is_variant else meant or FALLBACK_VARIANT)
    try:
        config = model.model_validate(source.data, context={ALLOW: allow_python})
        problems = _problems_of_start(config, source)
    except ValidationError as error:
        problems = problems_of(error, source, model)
    choices = f"expected one of {', '.join(VARIANTS)}{hint(variant, VARIANTS)}"
    problems = [
        replace(p, expected=choices) if p.key == VARIANT else p
        for p in source.new(problems)
        if is_variant or meant or p.key == VARIANT or not p.key.startswith(IN_VARIANT_SECTIONS)
    ]
    if source.problems or problems:
        raise ConfigError([*source.problems, *problems])
    return config


def _problems_of_start(config: Config, source: Source) -> list[ConfigProblem]:
    """Return the problem of a config whose run would end at its start, because θ2 is near ±90°."""
    regularity, bound = math.cos(config.initial.orientation[PITCH]), config.integration.range_bound
    if regularity > bound or config.integration.coordinates == "quaternion":
        return []
    problem = f"has cos θ2 = {regularity:.2g}, and a run ends where it is {bound:g} or less"
    largest = math.degrees(math.acos(bound))
    expected = f"expected |θ2| below {largest:.6g}°, or a smaller integration.range_bound"
    return [source.problem(("initial", "orientation"), problem, expected)]


def resolved(config: Config) -> dict[str, Any]:
    """Return a config as plain data, with all defaults and without keys that have no effect."""
    data = config.plain()
    integration = data["integration"]
    if integration["engine"] != "scipy":
        for key in SCIPY_ONLY:
            del integration[key]
    if integration.get("coordinates") != "manifold":
        integration.pop("drift_control", None)
    return data


def acting_sections(config: Config) -> dict[str, Any]:
    """Return what acts on the body as plain data: body, gravity, controller, and elements if any.

    Two configs with the same sections have the same rest states. The initial values of the own
    states of elements are left out.
    """
    data = resolved(config)
    sections = {name: data[name] for name in ("body", "gravity", "controller")}
    if config.elements:
        sections["elements"] = _split_elements(data)[0]
    return sections


def initial_sections(config: Config) -> list[Any]:
    """Return the initial state as plain data: the section, and that of the elements if any."""
    data = resolved(config)
    of_elements = _split_elements(data)[1]
    return [data["initial"], *([of_elements] if any(of_elements.values()) else [])]


def _split_elements(data: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the elements of a resolved config without and with only the keys of initial values."""
    acting, initial = {}, {}
    for name, section in data.get("elements", {}).items():
        acting[name] = {k: v for k, v in section.items() if not is_initial(k)}
        initial[name] = {k: v for k, v in section.items() if is_initial(k)}
        if section["kind"] == PYTHON:
            parameters = section[PARAMETERS].items()
            acting[name][PARAMETERS] = {k: v for k, v in parameters if not is_initial(k)}
            initial[name] |= {k: v for k, v in parameters if is_initial(k)}
    return acting, initial


def resolved_yaml(config: Config) -> str:
    """Return the resolved config as YAML; loading it gives the same config."""
    from rbstab.config.files.dump import as_yaml

    return as_yaml(resolved(config))


def identifying(config: Config) -> dict[str, Any]:
    """Return what decides the motion: the resolved config without what is only wanted of it."""
    return {name: value for name, value in resolved(config).items() if name not in WANTED}


def run_id(config: Config) -> str:
    """Return the identity of a run: a hash of what decides its motion.

    It is the first 32 hexadecimal digits of the SHA-256 of a canonical JSON text. Its keys are
    sorted and it has no spaces. Every number that may be a float is the shortest decimal that reads
    back as the same float.
    """
    return identity_of(identifying(config))


def identity_of(data: Any) -> str:
    """Return the identity of plain data, as `run_id` describes it."""
    text = json.dumps(data, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def _plain_data(value: Any, levels: int) -> Any:
    """Convert mappings, sequences and arrays to dicts and lists, the types of YAML data."""
    if levels < 0:
        raise ConfigError.at(Location("config"), *TOO_DEEP)
    if isinstance(value, Mapping):
        return {str(key): _plain_data(entry, levels - 1) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain_data(entry, levels - 1) for entry in value]
    return _plain_data(value.tolist(), levels) if hasattr(value, "tolist") else value
