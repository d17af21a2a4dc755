"""Load a plan from a file or from plain data, and convert it to YAML or plain data.

A converted plan has its base with all defaults filled in.
"""

from collections.abc import Iterable, Mapping
from math import prod
from pathlib import Path as FilePath
from typing import Any

from rbstab.config.errors import ConfigError
from rbstab.config.files.dump import as_yaml
from rbstab.config.load import PLAN_ONLY, VARIANT_SECTIONS, source_of
from rbstab.config.schema import Experiment
from rbstab.config.source import key_of
from rbstab.config.user_code.permission import Code
from rbstab.sweep.plan.axes import VARIANT, Axis
from rbstab.sweep.plan.bases import read_bases
from rbstab.sweep.plan.designs import DESIGNS, Design, RandomDesign
from rbstab.sweep.plan.keys import check_axes, check_changes, check_keys, check_names
from rbstab.sweep.plan.plan import MAX_MEMBERS, Plan
from rbstab.sweep.plan.plan_file import GRID, PlanFile, Problems, Proofs
from rbstab.sweep.plan.validity import problems_of_members

MEMBER_KEYS = ("vary", "design", "members", "seed")
"""The keys from which the members follow, apart from their base."""


def is_plan(file: FilePath | Mapping[str, Any]) -> bool:
    """Return whether a file, or its data, is a plan, valid or not: it has a key that no config has.

    Raises:
        ConfigError: The file cannot be read.
    """
    return not PLAN_ONLY.isdisjoint(source_of(file).data)


def is_config(file: FilePath | Mapping[str, Any]) -> bool:
    """Return whether a file, or its data, is a config, valid or not: no plan has such a section.

    Raises:
        ConfigError: The file cannot be read.
    """
    data = source_of(file).data
    sections = set(Experiment.model_fields) - set(PlanFile.model_fields)
    return PLAN_ONLY.isdisjoint(data) and not sections.isdisjoint(data)


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

        allow_python = allow_python or plan.may_run_code
        plan = plan_data(plan)
    return _loaded(plan, changes, Code.ALLOWED if allow_python else Code.REFUSED)


def plan_to_read(plan: str | FilePath | Mapping[str, Any]) -> Plan:
    """Load a plan to read it; its members cannot be run if it has elements of users.

    Raises:
        ConfigError: As `load_plan`.
    """
    return _loaded(plan, [], Code.NOT_RUN)


def _loaded(plan: str | FilePath | Mapping[str, Any], changes: list[str], code: Code) -> Plan:
    source = source_of(plan, "plan")
    if is_config(source.data):
        expected = "expected a plan with base and vary; rbstab.simulate runs a config"
        raise ConfigError([source.problem((), "is a config", expected)])
    problems = Problems(source)
    file = problems.read()
    # A wrong design is read as the default.
    name = file.design if source.data.get("design", GRID) == file.design else None
    axes = check_axes(problems, file, grid=name == GRID)
    design = _design(problems, file, name, axes)
    folder = FilePath() if isinstance(plan, Mapping) else FilePath(plan).parent
    knows_variants = not any(key_of(VARIANT) in problem.key for problem in problems)
    base = file.base if knows_variants else None
    bases = read_bases(problems, base, folder, _variants(axes), changes, code)
    if any(k.path[:2] == ("controller", "K_r") for axis in axes for k in axis.varied_keys):
        # Some members may read Euler angles, and all members have the same coordinates.
        bases = {name: base.in_angles() for name, base in bases.items()}
    loaded = Plan(file, bases, axes, design)
    if bases:
        check_keys(problems, loaded)
        check_changes(problems, loaded, changes)
    else:
        check_names(problems, axes)
    wrong = {problem.key.partition(".")[0] for problem in problems}
    if not source.problems and wrong.isdisjoint(MEMBER_KEYS):
        for number in loaded.keep.members:
            if number >= loaded.members:
                path, expected = ("keep", "traces"), f"expected members below {loaded.members}"
                problems.add(path, f"has {number}", expected)
                break
        if bases:
            problems += problems_of_members(loaded, source)
    if problems:
        raise ConfigError(problems)
    return loaded


def _design(
    problems: Problems, file: PlanFile, name: str | None, axes: tuple[Axis, ...]
) -> Design | None:
    """Return the design; None for a grid and, with problems added, for a wrong design."""
    for key in ("members", "seed"):
        if name == GRID and key in problems.source.data:
            problems.add((key,), "has no effect in a grid", f"expected no {key}", of_key=True)
        elif name not in (GRID, None) and key not in problems.source.data:
            problems.add((key,), "is missing", f"the design {name} requires it")
    if name == GRID:
        _check_member_count(problems, axes, 1)
        return None
    if name is None or not {"members", "seed"} <= file.model_fields_set:
        return None
    drawn = sum(not axis.each and not axis.counts_members for axis in axes)
    # Random points need no coordinates if only the numbers of the members differ.
    only_counted = name == RandomDesign.keyword and any(axis.counts_members for axis in axes)
    if axes and not drawn and not only_counted:
        problems.add(("design",), "has nothing to draw", "expected a key without `each`")
    limit = DESIGNS[name].max_points
    if limit is not None and file.members > limit:
        problem = f"is {file.members}, more than the design {name} allows"
        problems.add(("members",), problem, f"expected at most {limit}")
    _check_member_count(problems, [axis for axis in axes if axis.each], file.members)
    return DESIGNS[name](drawn, file.members, file.seed)


def _check_member_count(problems: Problems, counted: Iterable[Axis], points: int) -> None:
    members = points * prod(axis.length or 1 for axis in counted)
    if members > MAX_MEMBERS:
        shown = str(members) if members < 10**15 else f"about 10^{len(str(members)) - 1}"
        problems.add(("vary",), f"makes {shown} members", f"expected at most {MAX_MEMBERS}")


def _variants(axes: tuple[Axis, ...]) -> tuple[str, ...]:
    """Return the values of `controller.variant`; empty if the variant does not vary."""
    distributions = [k.distribution for axis in axes for k in axis.varied_keys if k.path == VARIANT]
    return tuple(distributions[0].root) if distributions else ()


def plan_yaml(plan: Plan) -> str:
    """Return a plan as YAML. It needs no other file, and loads as the same plan."""
    return as_yaml(plan_data(plan))


def plan_data(plan: Plan) -> dict[str, Any]:
    """Return a plan as plain data. It needs no other file, and loads as the same plan."""
    proofs = None if plan.prove is None else Proofs(motion=plan.prove)
    file = plan.file.model_copy(update={"prove": proofs})
    data = file.model_dump(mode="json", exclude_none=True)
    return data | {"base": _base(list(plan.templates.values()))}


def _base(bases: list[dict[str, Any]]) -> dict[str, Any]:
    """Merge the bases of all variants into one, without values that differ between variants."""
    if len(bases) == 1:
        return bases[0]
    merged = dict(bases[0])
    # Those that differ are defaults, and the name of the variant.
    for name in VARIANT_SECTIONS:
        sections = [base[name] for base in bases]
        merged[name] = {
            key: value
            for section in sections
            for key, value in section.items()
            if all(other.get(key, value) == value for other in sections)
        }
    return merged
