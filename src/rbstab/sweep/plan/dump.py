"""Convert a plan to YAML or plain data, including its base with all defaults filled in."""

from typing import Any

from rbstab.config.files.dump import as_yaml
from rbstab.config.load import VARIANT_SECTIONS
from rbstab.config.section import Section
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.plan.plan_file import GRID, PLAN_VERSION
from rbstab.sweep.plan.proof_selection import MOTION
from rbstab.sweep.plan.trace_selection import TraceSelection


def plan_yaml(plan: Plan) -> str:
    """Return a plan as YAML. It needs no other file, and loads as the same plan."""
    return as_yaml(plan_data(plan))


def plan_data(plan: Plan) -> dict[str, Any]:
    """Return a plan as plain data. It needs no other file, and loads as the same plan."""
    design = plan.design
    drawn = {} if design is None else {"members": design.points, "seed": design.seed}
    return {
        "schema_version": PLAN_VERSION,
        "title": plan.title,
        "base": _base(list(plan.templates.values())),
        "vary": {axis.name: _plain(axis.varied) for axis in plan.axes},
        "design": GRID if design is None else design.keyword,
        **drawn,
        "keep": _keep(plan.keep),
        **({} if plan.prove is None else {"prove": {MOTION: _plain(plan.prove)}}),
    }


def _base(bases: list[dict[str, Any]]) -> dict[str, Any]:
    """Merge the bases of all variants into one.

    Leave out values that differ between variants: defaults, and the name of the variant.
    """
    if len(bases) == 1:
        return bases[0]
    merged = dict(bases[0])
    for name in VARIANT_SECTIONS:
        sections = [base[name] for base in bases]
        merged[name] = {
            key: value
            for section in sections
            for key, value in section.items()
            if all(other.get(key, value) == value for other in sections)
        }
    return merged


def _plain(section: Section) -> dict[str, Any]:
    return section.model_dump(mode="json", exclude_none=True)


def _keep(keep: TraceSelection) -> Any:
    if keep.every == 1:
        return "traces"
    if keep.every:
        return {"traces": {"every": keep.every}}
    return {"traces": list(keep.members)} if keep.members else "summary"
