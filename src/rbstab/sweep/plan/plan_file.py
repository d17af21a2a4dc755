"""The file of a plan: one declaration from which its reading and its JSON Schema follow."""

from typing import Annotated, Any, Literal

from pydantic import (
    ConfigDict,
    Discriminator,
    Field,
    PlainValidator,
    Tag,
    model_validator,
)

from rbstab.config.errors import describe
from rbstab.config.quantities import Count, Text, value_error, version
from rbstab.config.section import Section, word_or
from rbstab.sweep.plan.distributions import (
    Geomspace,
    Linspace,
    Logspace,
    LogUniform,
    Member,
    Normal,
    NotNegativeWhole,
    Uniform,
    Values,
    listed,
)
from rbstab.sweep.plan.proof_selection import ProofSelection
from rbstab.sweep.plan.trace_selection import TraceSelection

PLAN_VERSION = 1

GRID = "grid"

_UNSET: Any = Field(default=None)


class Spread(Section):
    """A distribution: a mapping of its name to its arguments."""

    model_config = ConfigDict(json_schema_extra={"minProperties": 1, "maxProperties": 1})

    values: Values = _UNSET
    linspace: Linspace = _UNSET
    logspace: Logspace = _UNSET
    geomspace: Geomspace = _UNSET
    uniform: Uniform = _UNSET
    normal: Normal = _UNSET
    loguniform: LogUniform = _UNSET

    @property
    def content(self) -> tuple[str, Any]:
        """Its one key, and what stands there."""
        (key,) = self.model_fields_set
        return key, getattr(self, key)

    @model_validator(mode="after")
    def _has_one_key(self) -> "Spread":
        known = list(type(self).model_fields)
        keys = [key for key in known if key in self.model_fields_set]
        if len(keys) != 1:
            found = f"has {' and '.join(keys)}" if keys else "is empty"
            raise value_error(found, f"expected one of {', '.join(known)}")
        return self


class Column(Spread):
    """The values of a key, or factors on those of the base."""

    scale: Spread = _UNSET


Columns = Annotated[dict[str, Column], Field(min_length=1)]


class Group(Column):
    """One key, or several that vary together."""

    zip: Columns = _UNSET


class Varied(Group):
    """What stands at a key of `vary`."""

    each: Group = _UNSET
    member: Member = _UNSET


class Every(Section):
    """Every n-th member."""

    every: Count


_FORM = "[number, ...] or {every: n}"

_Numbers = Annotated[tuple[NotNegativeWhole, ...], *listed(_FORM, empty=True)]


class Traces(Section):
    """The members with traces."""

    traces: Annotated[
        Annotated[_Numbers, Tag("<numbers>")] | Annotated[Every, Tag("<every>")],
        Discriminator(lambda value: "<every>" if isinstance(value, dict | Every) else "<numbers>"),
    ]


class Proofs(Section):
    """The members whose motions are enclosed."""

    motion: ProofSelection


def _base(value: Any) -> Any:
    if not isinstance(value, dict | str) or value == "":
        raise value_error(f"is {describe(value)}", "expected the path of a config, or a config")
    return value


class PlanFile(Section):
    """The plan of a sweep."""

    schema_version: Annotated[Literal[1], version(PLAN_VERSION)] = 1
    title: Text = "untitled"
    base: Annotated[
        str | dict[str, Any],
        PlainValidator(_base, json_schema_input_type=str | dict[str, Any]),
        Field(description="path of a config, relative to the plan, or a config"),
    ]
    vary: Annotated[
        dict[str, Varied],
        Field(min_length=1, description="keys of the base, with the distributions of their values"),
    ]
    design: Literal["grid", "random", "sobol", "latin-hypercube"] = "grid"
    members: Annotated[Count, Field(description="not for a grid")] = _UNSET
    seed: Annotated[NotNegativeWhole, Field(description="not for a grid")] = _UNSET
    keep: Annotated[
        Literal["summary", "traces"] | Traces,
        word_or(("summary", "traces"), (Traces, _FORM)),
    ] = "summary"
    prove: Annotated[
        Literal["motion"] | Proofs,
        word_or(("motion",), (Proofs, "{steps: n, members: n}")),
        Field(description="enclose exact motions until their convergence is proved"),
    ] = _UNSET

    @property
    def traces(self) -> TraceSelection:
        """The members with traces."""
        if isinstance(self.keep, str):
            return TraceSelection(every=int(self.keep == "traces"))
        traces = self.keep.traces
        if isinstance(traces, Every):
            return TraceSelection(every=traces.every)
        return TraceSelection(members=tuple(sorted(set(traces))))

    @property
    def proofs(self) -> ProofSelection | None:
        """The members whose motions are enclosed; None: no member."""
        return (
            self.prove.motion if isinstance(self.prove, Proofs) else self.prove and ProofSelection()
        )


class ReadablePlan(PlanFile):
    """What is right in a file that is wrong elsewhere."""

    base: Any = None
    vary: dict[str, Varied] = Field(default={})


def plan_json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a plan, for editors; `load_plan` checks the rest."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **PlanFile.model_json_schema(),
        "title": f"rbstab plan of a sweep, schema version {PLAN_VERSION}",
        # All designs except the grid have `members` and `seed`.
        "if": {"properties": {"design": {"const": GRID}}},
        "then": {"properties": {"members": False, "seed": False}},
        "else": {"required": ["members", "seed"]},
    }
