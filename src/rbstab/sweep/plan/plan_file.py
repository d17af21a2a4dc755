"""The file of a plan: one declaration from which its reading and its JSON Schema follow."""

from bisect import bisect_left
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    ConfigDict,
    Discriminator,
    Field,
    PlainValidator,
    Tag,
    ValidationError,
    model_validator,
)

from rbstab.config.errors import ConfigProblem, describe
from rbstab.config.messages import problems_of
from rbstab.config.quantities import Count, Text, value_error, version
from rbstab.config.section import Section, word_or
from rbstab.config.source import Path, Source
from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.designs import DESIGNS
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
    def _has_single_key(self) -> "Spread":
        allowed = list(type(self).model_fields)
        keys = [key for key in allowed if key in self.model_fields_set]
        if len(keys) != 1:
            problem = f"has {' and '.join(keys)}" if keys else "is empty"
            raise value_error(problem, f"expected one of {', '.join(allowed)}")
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


@dataclass(frozen=True)
class TraceSelection:
    """The members with traces: every n-th, or a list. For other members only a summary is stored.

    Args:
        every: Members 0, n, 2n, ... have traces; 0: none.
        members: Numbers of members with traces, ascending.
    """

    every: int = 0
    members: tuple[int, ...] = ()

    def selected(self, start: int, stop: int) -> Array:
        """Return whether each member from `start` up to `stop` has a trace, shape (stop - start,).

        Args:
            start: The first member.
            stop: One after the last member, as in `range`.
        """
        if self.every:
            return np.arange(start, stop) % self.every == 0
        first, end = (bisect_left(self.members, number) for number in (start, stop))
        selected = np.zeros(stop - start, dtype=bool)
        selected[np.array(self.members[first:end], dtype=np.int64) - start] = True
        return selected

    def count(self, members: int) -> int:
        """Return the number of traces of a sweep with this number of members."""
        return -(-members // self.every) if self.every else len(self.members)


NO_TRACES = TraceSelection()


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
    design: Literal[GRID, *DESIGNS] = GRID  # type: ignore[valid-type]
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


class Problems(list[ConfigProblem]):
    """The problems that are found in the source of a plan, those of its text first."""

    def __init__(self, source: Source) -> None:
        super().__init__(source.problems)
        self.source = source

    def add(self, path: Path, problem: str, expected: str, *, of_key: bool = False) -> None:
        """Add a problem at a value or, with `of_key`, at its key.

        Args:
            path: The path of the value.
            problem: What is wrong.
            expected: What was expected instead.
            of_key: Whether the problem is at the key.
        """
        config_problem = self.source.problem(path, problem, expected, of_key=of_key)
        self += self.source.new([config_problem])

    def read(self) -> PlanFile:
        """Return what is right in the file, and add the problems of the rest."""
        data = self.source.data
        try:
            return PlanFile.model_validate(data)
        except ValidationError as error:
            self += self.source.new(problems_of(error, self.source, PlanFile))
            wrong = {
                detail["loc"][: 2 if detail["loc"][0] == "vary" else 1] for detail in error.errors()
            }
        right = {key: value for key, value in data.items() if (key,) not in wrong}
        if isinstance(right.get("vary"), dict):
            right["vary"] = {k: v for k, v in data["vary"].items() if ("vary", k) not in wrong}
        return ReadablePlan.model_validate(right)


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
