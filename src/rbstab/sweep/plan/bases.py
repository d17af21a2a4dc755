"""Read the base config of a plan, once for each variant of its members."""

from collections.abc import Iterable
from copy import deepcopy
from dataclasses import replace
from enum import Enum
from pathlib import Path as FilePath
from typing import Any

from rbstab.config.errors import ConfigError, ConfigProblem
from rbstab.config.files.named_files import embed_files
from rbstab.config.load import source_of, validated
from rbstab.config.messages import describe
from rbstab.config.overrides import override
from rbstab.config.schema import VARIANTS, Config, model_of
from rbstab.config.source import Source
from rbstab.config.user_code.permission import check_code
from rbstab.files.existence import is_file
from rbstab.sweep.plan.problems import ProblemCollector

VARIANT_SECTIONS = ("controller", "initial", "integration")
"""The sections whose keys depend on the variant."""


class Code(Enum):
    """What becomes of the code of users in a plan."""

    REFUSED = "a plan with code is refused"
    NOT_RUN = "it is read, and cannot be run"
    ALLOWED = "it may be run"


def read_bases(
    problems: ProblemCollector,
    folder: FilePath,
    variants: tuple[str, ...],
    changes: Iterable[str],
    code: Code,
) -> dict[str, Config]:
    """Read the base for each variant; if something is wrong, add problems and return {}.

    Args:
        problems: The source of the plan; collects the problems.
        folder: The folder to which the path of the base is relative.
        variants: The variants in the plan; if empty, the variant of the base.
        changes: Texts `key=value` that replace single values of the base.
        code: What becomes of the code of users.
    """
    source = _source_of_base(problems, folder)
    if source is None:
        return {}
    allowed = code is Code.ALLOWED
    bases: dict[str, Config] = {}
    by_variant: dict[str, list[ConfigProblem]] = {}
    wanted = tuple(dict.fromkeys(variants)) or ("",)
    try:
        override(source, changes)
        embed_files(source)
        for variant in wanted:
            try:
                own = _with_variant(source, variant) if variant else source
                base = validated(own, allow_python=allowed)
                if code is not Code.NOT_RUN:
                    check_code(base, source, allow_python=allowed)
                bases[base.controller.variant] = base
            except ConfigError as error:
                by_variant[variant] = list(error.problems)
    except ConfigError as error:
        by_variant = {"": list(error.problems)}
        wanted = ("",)
    inline = isinstance(problems.source.data["base"], dict)
    place = problems.source.location(()).source if inline else None
    problems.add_all(
        replace(p, key=f"base.{p.key}") if p.location.source == place else p
        for p in _merged(by_variant, len(wanted))
    )
    return {} if by_variant else bases


def _source_of_base(problems: ProblemCollector, folder: FilePath) -> Source | None:
    base = problems.source.data.get("base")
    if "base" not in problems.source.data:
        problems.add(("base",), "is missing", "it is required")
    elif isinstance(base, dict):
        return _subsource(problems.source, "base")
    elif not isinstance(base, str) or not base:
        problems.add_unexpected(("base",), base, "the path of a config, or a config")
    elif not _may_be_read(folder / base):
        expected = "expected the path of a config, relative to the plan"
        problems.add(("base",), f"is {describe(base)}, which is not a file", expected)
    else:
        return _read(problems, folder / base)
    return None


def _may_be_read(path: FilePath) -> bool:
    """Return whether a path leads to a file, or an error of the disk that reading it reports."""
    try:
        return is_file(path)
    except OSError:
        return True


def _read(problems: ProblemCollector, path: FilePath) -> Source | None:
    try:
        return source_of(path)
    except ConfigError as error:
        problems.found += error.problems
        return None


def _subsource(source: Source, key: str) -> Source:
    """Return the data at a key as a source, without the problems of the whole text."""
    values = {path[1:]: where for path, where in source.values.items() if path[:1] == (key,)}
    keys = {path[1:]: where for path, where in source.keys.items() if path[:1] == (key,)}
    values.setdefault((), source.location((key,)))
    return Source(deepcopy(source.data[key]), values, keys, folder=source.folder)


def _with_variant(source: Source, variant: str) -> Source:
    """Return the source with another variant, without the keys that only other variants have."""
    data = deepcopy(source.data)
    if isinstance(data.get("controller"), dict):
        data["controller"]["variant"] = variant
    for section in VARIANT_SECTIONS:
        own = _keys(variant, section)
        others: set[str] = set().union(*(_keys(other, section) for other in VARIANTS))
        if isinstance(data.get(section), dict):
            data[section] = {
                key: value
                for key, value in data[section].items()
                if key in own or key not in others
            }
    return replace(source, data=data)


def _keys(variant: str, section: str) -> set[str]:
    annotation: Any = model_of(variant).model_fields[section].annotation
    return set(annotation.model_fields)


def _merged(by_variant: dict[str, list[ConfigProblem]], variants: int) -> list[ConfigProblem]:
    """Return each problem once; if only some variants have it, name these variants."""
    variants_with: dict[ConfigProblem, list[str]] = {}
    for variant, found in by_variant.items():
        for problem in found:
            variants_with.setdefault(problem, []).append(variant)
    return [
        problem
        if len(names) == variants
        else replace(problem, problem=f"{problem.problem} for the variant {', '.join(names)}")
        for problem, names in variants_with.items()
    ]
