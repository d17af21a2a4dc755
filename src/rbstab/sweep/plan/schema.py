"""JSON Schema of a plan, for editors. It describes the syntax; `load_plan` checks the rest."""

from typing import Any

from rbstab.config.schema import VARIANTS
from rbstab.sweep.plan.designs import DESIGNS
from rbstab.sweep.plan.load import GRID
from rbstab.sweep.plan.plan import MAX_MEMBERS, MAX_TITLE_LENGTH, PLAN_VERSION
from rbstab.sweep.plan.proof_selection import LARGEST_STEPS, MOTION

_NUMBER = {"type": "number"}
_COUNT = {"type": "integer", "minimum": 1}


def _only(key: str, value: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a mapping with exactly one key."""
    return {
        "type": "object",
        "properties": {key: value},
        "required": [key],
        "additionalProperties": False,
    }


def _list_of(*entries: dict[str, Any], description: str) -> dict[str, Any]:
    size = len(entries)
    return {
        "type": "array",
        "prefixItems": list(entries),
        "minItems": size,
        "maxItems": size,
        "description": description,
    }


def _distributions() -> list[dict[str, Any]]:
    counted = {"linspace": "", "logspace": " of the exponents of 10", "geomspace": ", above 0"}
    paired = {"uniform": "[a, b]", "normal": "[mean, sd]", "loguniform": "[a, b], 0 < a < b"}
    names: list[dict[str, Any]] = [{"enum": list(VARIANTS)}, _NUMBER]
    listed = {"type": "array", "minItems": 1, "items": {"anyOf": names}}
    return [
        _only("values", listed),
        *(
            _only(key, _list_of(_NUMBER, _NUMBER, _COUNT, description=f"[first, last, count]{of}"))
            for key, of in counted.items()
        ),
        *(_only(key, _list_of(_NUMBER, _NUMBER, description=form)) for key, form in paired.items()),
        _only(
            "member",
            _list_of(
                {"type": "integer", "minimum": 0}, description="[first]: seeds that count members"
            ),
        ),
    ]


def _reference(name: str) -> dict[str, Any]:
    return {"$ref": f"#/$defs/{name}"}


def plan_json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a plan."""
    group = {"type": "object", "minProperties": 1, "additionalProperties": _reference("column")}
    axis = {"anyOf": [_reference("column"), _only("zip", group)]}
    numbers = {"type": "array", "minItems": 1, "items": {"type": "integer", "minimum": 0}}
    steps = {**_COUNT, "maximum": LARGEST_STEPS, "description": "of one enclosure"}
    limits = {
        "type": "object",
        "properties": {"steps": steps, "members": _COUNT},
        "minProperties": 1,
        "additionalProperties": False,
    }
    named = {"anyOf": [numbers, _only("every", _COUNT)]}
    properties = {
        "schema_version": {"const": PLAN_VERSION},
        "title": {"type": "string", "minLength": 1, "maxLength": MAX_TITLE_LENGTH},
        "base": {
            "type": ["string", "object"],
            "description": "path of a config, relative to the plan, or a config",
        },
        "vary": {
            "type": "object",
            "minProperties": 1,
            "additionalProperties": {"anyOf": [axis, _only("each", axis)]},
            "description": "keys of the base, with the distributions of their values",
        },
        "design": {"enum": [GRID, *DESIGNS]},
        "members": {**_COUNT, "maximum": MAX_MEMBERS, "description": "not for a grid"},
        "seed": {"type": "integer", "minimum": 0, "description": "not for a grid"},
        "keep": {"anyOf": [{"enum": ["summary", "traces"]}, _only("traces", named)]},
        "prove": {
            "anyOf": [{"const": MOTION}, _only(MOTION, limits)],
            "description": "enclose exact motions until their convergence is proved",
        },
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"rbstab plan of a sweep, schema version {PLAN_VERSION}",
        "type": "object",
        "properties": properties,
        "required": ["base", "vary"],
        "additionalProperties": False,
        # All designs except the grid have `members` and `seed`.
        "if": {"properties": {"design": {"const": GRID}}},
        "then": {"properties": {"members": False, "seed": False}},
        "else": {"required": ["members", "seed"]},
        "$defs": {
            "distribution": {"anyOf": _distributions()},
            "column": {
                "anyOf": [
                    _reference("distribution"),
                    _only("scale", _reference("distribution")),
                ]
            },
        },
    }
