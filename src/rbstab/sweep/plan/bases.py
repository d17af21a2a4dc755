"""Read the base config of a plan, once for each variant of its members."""

from copy import deepcopy
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any

from rbstab.config.errors import ConfigError, ConfigProblem, describe
from rbstab.config.files.named_files import embed_files
from rbstab.config.load import VARIANT_SECTIONS, loaded, source_of
from rbstab.config.overrides import override
from rbstab.config.schema import VARIANTS, Config, model_of
from rbstab.config.source import Source
from rbstab.config.user_code.permission import Code
from rbstab.files.paths import is_file
from rbstab.sweep.plan.plan_file import Problems


def read_bases(  # noqa: PLR0913, PLR0917 (a base and what changes it)
    problems: Problems,
    base: str | dict[str, Any] | None,
    folder: FilePath,
    variants: tuple[str, ...],
    changes: list[str],
    code: Code,
) -> dict[str, Config]:
    """Read the base for each variant; if something is wrong, add problems and return {}.

    Args:
        problems: The source of the plan; collects the problems.
        base: The base; None if it is wrong already.
        folder: The folder to which the path of the base is relative.
        variants: The variants in the plan; if empty, the variant of the base.
        changes: Texts `key=value` that replace single values of the base.
        code: What becomes of the code of users.
    """
    if base is None:
        return {}
    if isinstance(base, str) and _is_missing(folder / base):
        expected = "expected the path of a config, relative to the plan"
        problems.add(("base",), f"is {describe(base)}, which is not a file", expected)
        return {}
    try:
        source = source_of(folder / base) if isinstance(base, str) else _inline(problems.source)
        override(source, changes)
        embed_files(source)
    except ConfigError as error:
        problems += problems.source.new(error.problems)
        return {}
    if variants and "controller" not in source.data:
        expected = "expected controller in the base, whose variant varies"
        problems.add(("base",), "has no controller", expected)
        return {}
    wanted = tuple(dict.fromkeys(variants)) or ("",)
    bases: dict[str, Config] = {}
    wrong: dict[ConfigProblem, list[str]] = {}
    for variant in wanted:
        try:
            config = loaded(_of_variant(source, variant), code)
            bases[config.controller.variant] = config
        except ConfigError as error:
            for problem in error.problems:
                wrong.setdefault(problem, []).append(variant)
    inside = problems.source.location(()).source if isinstance(base, dict) else None
    for problem, names in wrong.items():
        of_some = f" for the variant {', '.join(names)}" if len(names) < len(wanted) else ""
        prefix = "base." if problem.location.source == inside else ""
        told = replace(problem, key=prefix + problem.key, problem=problem.problem + of_some)
        problems += problems.source.new([told])
    return {} if wrong else bases


def _is_missing(path: FilePath) -> bool:
    """Return whether there is no file at a path; reading it reports an error of the disk."""
    try:
        return not is_file(path)
    except OSError:
        return False


def _inline(source: Source) -> Source:
    """Return the base in a plan as a source, without the problems of the whole text."""
    values = {path[1:]: where for path, where in source.values.items() if path[:1] == ("base",)}
    keys = {path[1:]: where for path, where in source.keys.items() if path[:1] == ("base",)}
    values.setdefault((), source.location(("base",)))
    return Source(deepcopy(source.data["base"]), values, keys, folder=source.folder)


def _of_variant(source: Source, variant: str) -> Source:
    """Return the base as one of a variant, without keys that only others have; "" is its own."""
    data = deepcopy(source.data)
    if variant:
        if isinstance(data.get("controller"), dict):
            data["controller"]["variant"] = variant
        for section in VARIANT_SECTIONS:
            keys = {name: _keys(name, section) for name in VARIANTS}
            others = set().union(*keys.values()) - keys[variant]
            if isinstance(data.get(section), dict):
                data[section] = {k: v for k, v in data[section].items() if k not in others}
    return replace(source, data=data)


def _keys(variant: str, section: str) -> set[str]:
    annotation: Any = model_of(variant).model_fields[section].annotation
    return set(annotation.model_fields)
