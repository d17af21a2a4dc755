"""Load a plan from a file or from plain data."""

from collections.abc import Iterable, Mapping
from math import prod
from pathlib import Path as FilePath
from typing import Any

from rbstab.config.errors import ConfigError, ConfigProblem
from rbstab.config.load import PLAN_ONLY, source_of
from rbstab.config.quantities import whole
from rbstab.config.schema import Experiment
from rbstab.sweep.plan.axes import VARIANT, Axis
from rbstab.sweep.plan.bases import Code, read_bases
from rbstab.sweep.plan.designs import DESIGNS, Design, RandomDesign
from rbstab.sweep.plan.distributions import Values
from rbstab.sweep.plan.keys import check_changes, check_keys, check_names
from rbstab.sweep.plan.plan import (
    MAX_MEMBERS,
    MAX_TITLE_LENGTH,
    PLAN_VERSION,
    Plan,
)
from rbstab.sweep.plan.problems import ProblemCollector
from rbstab.sweep.plan.proof_selection import read_prove
from rbstab.sweep.plan.read_vary import read_vary
from rbstab.sweep.plan.trace_selection import TraceSelection
from rbstab.sweep.plan.validity import problems_of_members

KEYS = ("schema_version", "title", "base", "vary", "design", "members", "seed", "keep", "prove")
"""The keys of a plan."""

MEMBER_KEYS = ("vary", "design", "members", "seed")
"""The keys from which the members follow, apart from their base."""

GRID = "grid"


def is_plan(path: FilePath) -> bool:
    """Return whether a file is a plan, valid or not: it has a key that no config has.

    Raises:
        ConfigError: The file cannot be read.
    """
    return not PLAN_ONLY.isdisjoint(source_of(path).data)


def is_config(path: FilePath) -> bool:
    """Return whether a file is a config, valid or not: it has a section that no plan has.

    Raises:
        ConfigError: The file cannot be read.
    """
    return _is_config(source_of(path).data)


def _is_config(data: Mapping[str, Any]) -> bool:
    return PLAN_ONLY.isdisjoint(data) and not set(Experiment.model_fields).isdisjoint(
        data.keys() - set(KEYS)
    )


def load_plan(
    plan: str | FilePath | Mapping[str, Any] | Plan,
    changes: Iterable[str] = (),
    *,
    allow_python: bool = False,
) -> Plan:
    """Load a plan, and check that every member is a valid config.

    Args:
        plan: The path of a YAML file, a dictionary with the same keys, or a loaded plan that is to
            be changed. In a dictionary, the path of a base is relative to the working directory. A
            loaded plan keeps its `allow_python`.
        changes: Strings `key=value` that replace single values of the base, as `--set` does.
        allow_python: Whether the files of users' elements may be run (see `load_config`). Without
            it, a plan with such an element is refused.

    Returns:
        The plan, immutable; `plan.members` is its number of members.

    Raises:
        ConfigError: The plan is invalid. All problems are listed, each as
            `file:line:column: key: what is wrong (what was expected)`.
    """
    changes = [changes] if isinstance(changes, str) else list(changes)
    if isinstance(plan, Plan):
        if not changes and not allow_python:
            return plan
        # Imported late: it stands on this module.
        from rbstab.sweep.plan.dump import plan_data

        allow_python = allow_python or plan.may_run_code
        plan = plan_data(plan)
    return _loaded(plan, changes, Code.ALLOWED if allow_python else Code.REFUSED)


def plan_to_read(plan: str | FilePath | Mapping[str, Any]) -> Plan:
    """Load a plan to read it; its members cannot be run if it has elements of users.

    Raises:
        ConfigError: As `load_plan`.
    """
    return _loaded(plan, (), Code.NOT_RUN)


def _loaded(plan: str | FilePath | Mapping[str, Any], changes: Iterable[str], code: Code) -> Plan:
    problems = ProblemCollector(source_of(plan, "plan"))
    folder = FilePath() if isinstance(plan, Mapping) else FilePath(plan).parent
    data = problems.source.data
    if _is_config(data):
        expected = "expected a plan with base and vary; rbstab.simulate runs a config"
        raise ConfigError(
            [ConfigProblem(problems.source.location(()), "", "is a config", expected)]
        )
    problems.add_unknown_keys((), data, KEYS)
    _check_version(problems)
    name = _design_name(problems)
    axes = read_vary(problems, grid=name == GRID)
    title, design = _title(problems), _design(problems, name, axes)
    keep, prove = _keep(problems), read_prove(problems)
    changes = [changes] if isinstance(changes, str) else list(changes)
    bases = read_bases(problems, folder, _variants(axes), changes, code)
    loaded = Plan(title, bases, axes, design, keep, prove)
    if bases:
        check_keys(problems, loaded)
        check_changes(problems, loaded, changes)
    else:
        check_names(problems, axes)
    if _knows_members(problems):
        _check_members_with_traces(problems, loaded)
        if bases:
            problems.found += problems_of_members(loaded, problems.source)
    if problems.found:
        raise ConfigError(problems.found, complete=not problems.is_full)
    return loaded


def _knows_members(problems: ProblemCollector) -> bool:
    """Whether nothing is wrong that the members follow from, apart from their base."""
    wrong = {problem.key.partition(".")[0] for problem in problems.found}
    return not problems.source.problems and wrong.isdisjoint(MEMBER_KEYS)


def _check_version(problems: ProblemCollector) -> None:
    version = whole(problems.source.data.get("schema_version", PLAN_VERSION))
    if isinstance(version, int) and not isinstance(version, bool) and version != PLAN_VERSION:
        problem = f"is {version}, which this version of rbstab does not support"
        problems.add(("schema_version",), problem, f"expected {PLAN_VERSION}")
    elif type(version) is not int:
        problems.add_unexpected(("schema_version",), version, str(PLAN_VERSION))


def _title(problems: ProblemCollector) -> str:
    title = problems.source.data.get("title", "untitled")
    if not isinstance(title, str):
        problems.add_unexpected(("title",), title, "a text")
    elif not title:
        problems.add(("title",), "is empty", "expected a text")
    elif len(title) > MAX_TITLE_LENGTH:
        problem = f"has {len(title)} characters"
        problems.add(("title",), problem, f"expected at most {MAX_TITLE_LENGTH}")
    elif "\0" in title:
        problems.add(("title",), "has a null character", "expected a text that HDF5 can hold")
    return str(title)


def _design_name(problems: ProblemCollector) -> str | None:
    """Return the name of the design; if it is wrong, add a problem and return None."""
    name = problems.source.data.get("design", GRID)
    if isinstance(name, str) and name in (GRID, *DESIGNS):
        return name
    problems.add_unexpected(("design",), name, f"one of {', '.join((GRID, *DESIGNS))}")
    return None


def _design(problems: ProblemCollector, name: str | None, axes: tuple[Axis, ...]) -> Design | None:
    """Return the design; None for a grid and, with problems added, for a wrong design."""
    data = problems.source.data
    if name == GRID:
        for key in ("members", "seed"):
            if key in data:
                problem = "has no effect in a grid"
                problems.add((key,), problem, f"expected no {key}", of_key=True)
        _check_member_count(problems, axes, 1)
        return None
    found: dict[str, int | None] = {}
    for key, minimum in (("members", 1), ("seed", 0)):
        if key in data:
            found[key] = problems.read_integer((key,), data[key], minimum)
        elif name is not None:
            problems.add((key,), "is missing", f"the design {name} requires it")
    members, seed = found.get("members"), found.get("seed")
    if name is None or members is None or seed is None:
        return None
    drawn = sum(not axis.each and not axis.counts_members for axis in axes)
    # Random points need no coordinates if only the numbers of the members differ.
    only_counted = name == RandomDesign.keyword and any(axis.counts_members for axis in axes)
    if axes and not drawn and not only_counted:
        problems.add(("design",), "has nothing to draw", "expected a key without `each`")
    limit = DESIGNS[name].max_points
    if limit is not None and members > limit:
        problem = f"is {members}, more than the design {name} allows"
        problems.add(("members",), problem, f"expected at most {limit}")
    _check_member_count(problems, [axis for axis in axes if axis.each], members)
    return DESIGNS[name](drawn, members, seed)


def _check_member_count(problems: ProblemCollector, counted: Iterable[Axis], points: int) -> None:
    members = points * prod(axis.length or 1 for axis in counted)
    if members > MAX_MEMBERS:
        problem = f"makes {_approximately(members)} members"
        problems.add(("vary",), problem, f"expected at most {MAX_MEMBERS}")


def _approximately(number: int) -> str:
    text = str(number)
    return text if len(text) <= 15 else f"about 10^{len(text) - 1}"


def _keep(problems: ProblemCollector) -> TraceSelection:
    keep = problems.source.data.get("keep", "summary")
    forms = "summary, traces, {traces: [number, ...]} or {traces: {every: n}}"
    if keep in ("summary", "traces"):
        return TraceSelection(every=int(keep == "traces"))
    if not isinstance(keep, dict) or not keep:
        problems.add_unexpected(("keep",), keep, forms)
        return TraceSelection()
    problems.add_unknown_keys(("keep",), keep, ("traces",))
    path, traces = ("keep", "traces"), keep.get("traces", {})
    if isinstance(traces, dict):
        if "traces" in keep and "every" not in traces:
            problems.add((*path, "every"), "is missing", "it is required")
        problems.add_unknown_keys(path, traces, ("every",))
        every = problems.read_integer((*path, "every"), traces.get("every", 1), 1)
        return TraceSelection(every=every or 0)
    if not isinstance(traces, list):
        problems.add_unexpected(path, traces, "[number, ...] or {every: n}")
        return TraceSelection()
    entries = problems.unless_full(enumerate(traces))
    numbers = {problems.read_integer((*path, i), entry, 0) for i, entry in entries}
    return TraceSelection(members=tuple(sorted(number for number in numbers if number is not None)))


def _check_members_with_traces(problems: ProblemCollector, plan: Plan) -> None:
    """Add a problem for each number in `keep` that is not the number of a member."""
    if plan.keep.members:
        numbers = problems.source.data["keep"]["traces"]
        for index, number in problems.unless_full(enumerate(numbers)):
            if number >= plan.members:
                expected = f"expected a member below {plan.members}"
                problems.add(("keep", "traces", index), f"is {number}", expected)


def _variants(axes: tuple[Axis, ...]) -> tuple[str, ...]:
    """Return the values of `controller.variant`; empty if the variant does not vary."""
    found = [k.distribution for axis in axes for k in axis.varied_keys if k.path == VARIANT]
    return tuple(str(name) for d in found[:1] if isinstance(d, Values) for name in d.entries)
