"""A config from a file, from plain data, and back."""

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path as FilePath
from typing import Any, cast

from pydantic import ValidationError

from rbstab.config.errors import ConfigError, Location, Problem
from rbstab.config.messages import described, problems_of
from rbstab.config.overrides import override
from rbstab.config.schema import SCHEMA_VERSION, VARIANTS, Config
from rbstab.config.source import MAX_DEPTH, Source, read_source

STAND_IN = "visco-elastic"
"""The variant against which a config of unknown variant is checked where variants agree."""

VARIANT_KEYS = (
    "controller",
    "initial.position",
    "initial.velocity",
    "initial.connector_state",
    "integration.coordinates",
    "integration.drift_control",
)
"""Keys that cannot be judged before the variant is known."""

SCIPY_ONLY = ("method", "atol")


def load_config(config: str | FilePath | Mapping[str, Any], changes: Iterable[str] = ()) -> Config:
    """A validated, immutable config.

    Args:
        config: The path of a YAML file, or the same as plain data.
        changes: Texts `key=value` that replace single values, as `--set` does.

    Raises:
        ConfigError: With everything that is wrong, each as
            `file:line:column: key: what is wrong (what was expected)`.
    """
    source = source_of(config)
    override(source, [changes] if isinstance(changes, str) else changes)
    return validated(source)


def source_of(document: str | FilePath | Mapping[str, Any], name: str = "config") -> Source:
    """The source of a document that must be a mapping: of a YAML file, or of plain data.

    Args:
        document: The path of the file, or the data.
        name: Stands for plain data in messages.

    Raises:
        ConfigError: It cannot be read, or is something else.
    """
    if isinstance(document, Mapping):
        source = Source(_plain(document, MAX_DEPTH), {(): Location(name)})
    else:
        source = read_source(FilePath(document))
    if source.data is None:
        source.data = {}  # an empty file lacks what every document needs
    if not isinstance(source.data, dict):
        found = f"is {described(source.data)}"
        raise ConfigError([Problem(source.location(()), "", found, "expected a mapping")])
    return source


def validated(source: Source) -> Config:
    """The config of a source.

    Raises:
        ConfigError: As `load_config`.
    """
    variant_problem = _problem_of_variant(source)
    name = STAND_IN if variant_problem else source.data["controller"]["variant"]
    model = VARIANTS[name]
    try:
        config = model.model_validate(source.data)
    except ValidationError as error:
        problems = problems_of(error, source, model)
    else:
        problems = []
    # What stands in place of an alias or a repeated key is not worth a second complaint.
    known = {problem.location for problem in source.problems}
    problems = source.problems + [p for p in problems if p.location not in known]
    if variant_problem is None and not problems:
        return cast("Config", config)
    if variant_problem is not None:
        shared = [p for p in problems if p in source.problems or not _depends_on_variant(p.key)]
        problems = [variant_problem, *shared]
    raise ConfigError([_newer_schema(p, source) for p in problems])


def resolved(config: Config) -> dict[str, Any]:
    """A config as plain data with every default filled in and keys without effect left out."""
    data: dict[str, Any] = config.model_dump(mode="json", exclude_none=True)
    integration = data["integration"]
    if integration["engine"] != "scipy":
        for key in SCIPY_ONLY:
            del integration[key]
    if integration["coordinates"] == "reduced":
        del integration["drift_control"]
    return data


def resolved_yaml(config: Config) -> str:
    """The resolved config as YAML, which loads again as the same config."""
    from rbstab.config.dump import as_yaml

    return as_yaml(resolved(config))


def run_id(config: Config) -> str:
    """The identity of a run: the first 32 hexadecimal digits of the SHA-256 of its resolved config.

    The text that is hashed is canonical: keys sorted, no spaces, every number that may be a float
    written as the shortest decimal that reads back as the same float.
    """
    text = json.dumps(resolved(config), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def _problem_of_variant(source: Source) -> Problem | None:
    controller = source.data.get("controller")
    expected = f"expected one of {', '.join(VARIANTS)}"
    if controller is None or not isinstance(controller, dict):
        found = "is missing" if controller is None else f"is {described(controller)}"
        return Problem(source.location(("controller",)), "controller", found, "expected a mapping")
    key, where = "controller.variant", source.location(("controller", "variant"))
    if "variant" not in controller:
        return Problem(where, key, "is missing", expected)
    variant = controller["variant"]
    if not isinstance(variant, str) or variant not in VARIANTS:
        return Problem(where, key, f"is {described(variant)}", expected)
    return None


def _depends_on_variant(key: str) -> bool:
    return any(key == known or key.startswith((f"{known}.", f"{known}[")) for known in VARIANT_KEYS)


def _newer_schema(problem: Problem, source: Source) -> Problem:
    version = source.data.get("schema_version")
    if problem.key != "schema_version" or not isinstance(version, int):
        return problem
    what = f"is {version}, which this version of rbstab does not know"
    return Problem(problem.location, problem.key, what, f"expected {SCHEMA_VERSION}")


def _plain(value: Any, levels: int) -> Any:
    """Mappings, sequences and arrays as the dicts and lists that a YAML file gives."""
    if levels < 0:
        problem = Problem(
            Location("config"), "", "is nested too deeply", f"at most {MAX_DEPTH} levels"
        )
        raise ConfigError([problem])
    if isinstance(value, Mapping):
        return {str(key): _plain(entry, levels - 1) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry, levels - 1) for entry in value]
    return _plain(value.tolist(), levels) if hasattr(value, "tolist") else value
