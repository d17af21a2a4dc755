"""The config that the members of a plan differ from, for each variant that they have."""

from collections.abc import Iterable
from copy import deepcopy
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any

from rbstab.config.errors import ConfigError, Problem
from rbstab.config.load import source_of, validated
from rbstab.config.messages import described
from rbstab.config.overrides import override
from rbstab.config.schema import VARIANTS, Config
from rbstab.config.source import Source
from rbstab.sweep.plan.problems import ProblemCollector

SHARED = ("controller", "initial", "integration")
"""The sections whose keys depend on the variant."""


def read_bases(
    findings: ProblemCollector, folder: FilePath, variants: tuple[str, ...], changes: Iterable[str]
) -> dict[str, Config]:
    """The base for each variant; empty, with notes, where something is wrong.

    Args:
        findings: The plan, and where problems are noted.
        folder: What the path of the base is relative to.
        variants: Those that the plan names; none: the one of the base.
        changes: Texts `key=value` that replace single values of the base.
    """
    before = len(findings.problems)
    source = _source_of_base(findings, folder)
    if source is None:
        return {}
    bases: dict[str, Config] = {}
    problems: dict[str, list[Problem]] = {}
    wanted = tuple(dict.fromkeys(variants)) or ("",)
    try:
        override(source, changes)
        for variant in wanted:
            try:
                base = validated(_of_variant(source, variant) if variant else source)
                bases[base.controller.variant] = base
            except ConfigError as error:
                problems[variant] = list(error.problems)
    except ConfigError as error:
        problems = {"": list(error.problems)}
        wanted = ("",)
    inline = isinstance(findings.source.data["base"], dict)
    place = findings.source.location(()).source if inline else None
    findings.add(
        replace(p, key=f"base.{p.key}") if p.location.source == place else p
        for p in _told_once(problems, len(wanted))
    )
    return bases if len(findings.problems) == before else {}


def _source_of_base(findings: ProblemCollector, folder: FilePath) -> Source | None:
    base = findings.source.data.get("base")
    if "base" not in findings.source.data:
        findings.note(("base",), "is missing", "it is required")
    elif isinstance(base, dict):
        return _inside(findings.source, "base")
    elif not isinstance(base, str) or not base:
        findings.is_no(("base",), base, "the path of a config, or a config")
    elif "\0" in base or not (folder / base).is_file():
        expected = "expected the path of a config, relative to the plan"
        findings.note(("base",), f"is {described(base)}, where there is no file", expected)
    else:
        return _read(findings, folder / base)
    return None


def _read(findings: ProblemCollector, path: FilePath) -> Source | None:
    try:
        return source_of(path)
    except ConfigError as error:
        findings.problems += error.problems
        return None


def _inside(source: Source, key: str) -> Source:
    """A part of a source as a source of its own, whose problems are told by the whole."""
    values = {path[1:]: where for path, where in source.values.items() if path[:1] == (key,)}
    keys = {path[1:]: where for path, where in source.keys.items() if path[:1] == (key,)}
    values.setdefault((), source.location((key,)))
    return Source(deepcopy(source.data[key]), values, keys)


def _of_variant(source: Source, variant: str) -> Source:
    """The source with another variant, and without the keys that only others have."""
    data = deepcopy(source.data)
    if isinstance(data.get("controller"), dict):
        data["controller"]["variant"] = variant
    for section in SHARED:
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
    annotation: Any = VARIANTS[variant].model_fields[section].annotation
    return set(annotation.model_fields)


def _told_once(problems: dict[str, list[Problem]], variants: int) -> list[Problem]:
    """Problems of every variant once; of those of some, which one is named."""
    told: dict[Problem, list[str]] = {}
    for variant, found in problems.items():
        for problem in found:
            told.setdefault(problem, []).append(variant)
    return [
        problem
        if len(names) == variants
        else replace(problem, problem=f"{problem.problem} for the variant {', '.join(names)}")
        for problem, names in told.items()
    ]
