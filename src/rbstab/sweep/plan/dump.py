"""Convert a plan to YAML or plain data, including its base with all defaults filled in."""

from typing import Any

from rbstab.config.files.dump import as_yaml
from rbstab.config.load import VARIANT_SECTIONS
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.plan.plan_file import Proofs


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
