"""A plan from a file or from plain data."""

from collections.abc import Iterable, Mapping
from math import prod
from pathlib import Path as FilePath
from typing import Any

from rbstab.config.errors import ConfigError
from rbstab.config.load import source_of
from rbstab.sweep.plan.axes import VARIANT, Axis
from rbstab.sweep.plan.bases import read_bases
from rbstab.sweep.plan.designs import DESIGNS, Design, LatinHypercubeDesign
from rbstab.sweep.plan.distributions import Values
from rbstab.sweep.plan.keys import check_keys
from rbstab.sweep.plan.plan import (
    MAX_LATIN_MEMBERS,
    MAX_MEMBERS,
    MAX_TITLE_LENGTH,
    PLAN_VERSION,
    Plan,
)
from rbstab.sweep.plan.problems import ProblemCollector
from rbstab.sweep.plan.read_vary import read_vary
from rbstab.sweep.plan.trace_selection import TraceSelection
from rbstab.sweep.plan.validity import problems_of_members

KEYS = ("schema_version", "title", "base", "vary", "design", "members", "seed", "keep")
"""Those of a plan."""

GRID = "grid"


def is_plan(path: FilePath) -> bool:
    """Whether a file is meant as a plan, right or wrong: it has keys that no config has.

    Raises:
        ConfigError: It cannot be read.
    """
    data = source_of(path).data
    return "vary" in data or "base" in data


def load_plan(plan: str | FilePath | Mapping[str, Any], changes: Iterable[str] = ()) -> Plan:
    """A validated, immutable plan: every one of its members is a config that can be run.

    Args:
        plan: The path of a YAML file, or the same as plain data (then a base is looked for from
            the working directory).
        changes: Texts `key=value` that replace single values of the base, as `--set` does.

    Raises:
        ConfigError: With everything that is wrong, each as
            `file:line:column: key: what is wrong (what was expected)`.
    """
    folder = FilePath() if isinstance(plan, Mapping) else FilePath(plan).parent
    findings = ProblemCollector(source_of(plan, "plan"))
    data = findings.source.data
    findings.unknown_keys((), data, KEYS)
    _check_version(findings)
    word = _design_word(findings)
    axes = read_vary(findings, grid=word == GRID)
    title, design = _title(findings), _design(findings, word, axes)
    keep = _keep(findings)
    changes = [changes] if isinstance(changes, str) else changes
    bases = read_bases(findings, folder, _variants(axes), changes)
    made = Plan(title, bases, axes, design, keep)
    if bases:
        check_keys(findings, made)
    if not findings.problems:
        _check_kept(findings, made)
        findings.problems += problems_of_members(made, findings.source)
    if findings.problems:
        raise ConfigError(findings.problems)
    return made


def _check_version(findings: ProblemCollector) -> None:
    version = findings.source.data.get("schema_version", PLAN_VERSION)
    if isinstance(version, int) and not isinstance(version, bool) and version != PLAN_VERSION:
        what = f"is {version}, which this version of rbstab does not know"
        findings.note(("schema_version",), what, f"expected {PLAN_VERSION}")
    elif type(version) is not int:
        findings.is_no(("schema_version",), version, str(PLAN_VERSION))


def _title(findings: ProblemCollector) -> str:
    title = findings.source.data.get("title", "untitled")
    if not isinstance(title, str):
        findings.is_no(("title",), title, "a text")
    elif not title:
        findings.note(("title",), "is empty", "expected a text")
    elif len(title) > MAX_TITLE_LENGTH:
        found = f"has {len(title)} characters"
        findings.note(("title",), found, f"expected at most {MAX_TITLE_LENGTH}")
    elif "\0" in title:
        findings.note(("title",), "has a null character", "expected a text that HDF5 can hold")
    return str(title)


def _design_word(findings: ProblemCollector) -> str | None:
    """The name of the design, or None with a note."""
    word = findings.source.data.get("design", GRID)
    if isinstance(word, str) and word in (GRID, *DESIGNS):
        return word
    findings.is_no(("design",), word, f"one of {', '.join((GRID, *DESIGNS))}")
    return None


def _design(findings: ProblemCollector, word: str | None, axes: tuple[Axis, ...]) -> Design | None:
    """The design; None for a grid, and with notes where it is wrong."""
    data = findings.source.data
    if word == GRID:
        for key in ("members", "seed"):
            if key in data:
                problem = "has no effect in a grid"
                findings.note((key,), problem, f"expected no {key}", of_key=True)
        _check_cap(findings, axes, 1)
        return None
    found: dict[str, int | None] = {}
    for key, least in (("members", 1), ("seed", 0)):
        if key in data:
            found[key] = findings.whole((key,), data[key], least)
        elif word is not None:
            findings.note((key,), "is missing", f"the design {word} requires it")
    members, seed = found.get("members"), found.get("seed")
    if word is None or members is None or seed is None:
        return None
    drawn = sum(not axis.each for axis in axes)
    if axes and not drawn:
        findings.note(("design",), "has nothing to draw", "expected a key without `each`")
    if word == LatinHypercubeDesign.word and members > MAX_LATIN_MEMBERS:
        problem = f"is {members}, more than a latin hypercube may have"
        findings.note(("members",), problem, f"expected at most {MAX_LATIN_MEMBERS}")
    _check_cap(findings, [axis for axis in axes if axis.each], members)
    return DESIGNS[word](drawn, members, seed)


def _check_cap(findings: ProblemCollector, counted: Iterable[Axis], points: int) -> None:
    members = points * prod(axis.length or 1 for axis in counted)
    if members > MAX_MEMBERS:
        problem = f"makes {_approximately(members)} members"
        findings.note(("vary",), problem, f"expected at most {MAX_MEMBERS}")


def _approximately(number: int) -> str:
    text = str(number)
    return text if len(text) <= 15 else f"about 10^{len(text) - 1}"


def _keep(findings: ProblemCollector) -> TraceSelection:
    keep = findings.source.data.get("keep", "summary")
    forms = "summary, traces, {traces: [number, ...]} or {traces: {every: n}}"
    if keep in ("summary", "traces"):
        return TraceSelection(every=int(keep == "traces"))
    if not isinstance(keep, dict) or not keep:
        findings.is_no(("keep",), keep, forms)
        return TraceSelection()
    findings.unknown_keys(("keep",), keep, ("traces",))
    path, traces = ("keep", "traces"), keep.get("traces", {})
    if isinstance(traces, dict):
        if "traces" in keep and "every" not in traces:
            findings.note((*path, "every"), "is missing", "it is required")
        findings.unknown_keys(path, traces, ("every",))
        every = findings.whole((*path, "every"), traces.get("every", 1), 1)
        return TraceSelection(every=every or 0)
    if not isinstance(traces, list):
        findings.is_no(path, traces, "[number, ...] or {every: n}")
        return TraceSelection()
    numbers = {findings.whole((*path, index), entry, 0) for index, entry in enumerate(traces)}
    return TraceSelection(members=tuple(sorted(number for number in numbers if number is not None)))


def _check_kept(findings: ProblemCollector, plan: Plan) -> None:
    """Notes the members that are to be kept and are not there."""
    if plan.keep.members:
        for index, number in enumerate(findings.source.data["keep"]["traces"]):
            if number >= plan.members:
                expected = f"expected a member below {plan.members}"
                findings.note(("keep", "traces", index), f"is {number}", expected)


def _variants(axes: tuple[Axis, ...]) -> tuple[str, ...]:
    """The variants that are varied."""
    found = [c.distribution for axis in axes for c in axis.columns if c.path == VARIANT]
    return tuple(str(name) for d in found[:1] if isinstance(d, Values) for name in d.entries)
