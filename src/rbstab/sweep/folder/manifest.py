"""The manifest of a sweep's folder: its content, its limits, and reading it."""

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    StringConstraints,
    field_validator,
    model_validator,
)

from rbstab.elements.declarations import OwnState
from rbstab.integrate.engines import ENGINES
from rbstab.store.disk.existence import path_exists
from rbstab.store.document import checked, read_document
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.sweep.members.outcome import final_columns, known_columns
from rbstab.sweep.plan.plan import MAX_MEMBERS, MAX_TITLE_LENGTH, Plan
from rbstab.sweep.plan.trace_selection import NO_TRACES, TraceSelection

MANIFEST = "manifest.json"
"""The name of the file."""

MANIFEST_VERSION = 2
"""Version 1 had no traces, and its shards were HDF5."""

MAX_SHARDS = MAX_MEMBERS // 16
"""The most shards of a sweep. It allows the smallest default size of a shard for all sweeps."""

_MAX_INTEGER = 2**62
"""Shards may be larger than the sweep, and so may the distance between members with traces."""

_MAX_COLUMNS = 1000
_MAX_VERSIONS = 50

FIRST_COLUMNS = (
    "status",
    "end_time",
    "final_orientation",
    "final_angular_velocity",
    "final_position",
    "final_velocity",
    "final_connector_state",
    "lyapunov_start",
    "lyapunov_end",
    "energy_residual",
    "peak_contact_displacement",
    "peak_time",
    "peak_orientation",
    "smallest_regularity",
    "settling_time",
    "displacement_settling_time",
    "steps",
)
"""The columns of older folders. Their manifests do not list columns, and later ones have more."""

_Id = Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{32}$")]
_Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$", max_length=100)]
_Text = Annotated[str, StringConstraints(max_length=100)]
_LongText = Annotated[str, StringConstraints(max_length=1000)]
_StateName = Annotated[
    str,
    StringConstraints(pattern=r"^[a-z][a-z0-9_]{0,39}\.[A-Za-z_][A-Za-z0-9_]*$", max_length=90),
]
_Column = Annotated[
    str, StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z0-9_]+)?$", max_length=100)
]
"""The final value of an own state of a named element has a dot in its name."""


class StoredState(BaseModel):
    """An own state of a named element (`OwnState`)."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    name: _StateName
    symbol: _Text
    unit: _Text
    description: _LongText
    size: int = Field(ge=1, le=1000)


class Manifest(BaseModel):
    """The properties of a sweep that do not change while it runs.

    Attributes:
        plan_id: The identity of the plan.
        title: The title of the plan.
        members: The number of members.
        shard_size: Members of a shard; the last one may have fewer.
        engine: The name of the engine.
        versions: The versions of rbstab and its libraries when the sweep was started.
        keep: The members with traces.
        columns: The columns of the shards, set by the version of rbstab that started the sweep.
        own_states: The own states of named elements. Their final values are columns.
        schema_version: The version of the folder's format.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    plan_id: _Id
    title: Annotated[str, StringConstraints(max_length=MAX_TITLE_LENGTH)]
    members: int = Field(ge=1, le=MAX_MEMBERS)
    shard_size: int = Field(ge=1, le=_MAX_INTEGER)
    engine: _Name
    versions: Annotated[dict[_Name, _Text], Field(max_length=_MAX_VERSIONS)]
    keep: TraceSelection = NO_TRACES
    columns: Annotated[tuple[_Column, ...], Field(max_length=_MAX_COLUMNS)] = FIRST_COLUMNS
    own_states: Annotated[tuple[StoredState, ...], Field(max_length=_MAX_COLUMNS)] = ()
    schema_version: int = MANIFEST_VERSION

    @field_validator("columns")
    @classmethod
    def _without_run_ids(cls, columns: tuple[str, ...]) -> tuple[str, ...]:
        """Leave out a column of shards that were stored before it was dropped."""
        return tuple(name for name in columns if name != "run_id")

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.shards > MAX_SHARDS:
            raise ValueError(f"{self.members} members in shards of {self.shard_size}")
        if len(set(self.columns)) != len(self.columns):
            raise ValueError("a column is listed twice")
        for name in FIRST_COLUMNS:
            if name not in self.columns:
                raise ValueError(f"the column {name} is missing")
        listed = self.keep.members
        if not 0 <= self.keep.every <= _MAX_INTEGER or (self.keep.every and listed):
            raise ValueError("no plan selects such traces")
        if any(a >= b for a, b in pairwise((-1, *listed, self.members))):
            raise ValueError("the members with traces are not ascending numbers of members")
        return self

    @property
    def shards(self) -> int:
        """The number of shards."""
        return -(-self.members // self.shard_size)

    @property
    def states(self) -> tuple[OwnState, ...]:
        """The own states of named elements."""
        return tuple(OwnState(**state.model_dump()) for state in self.own_states)

    def as_data(self) -> dict[str, Any]:
        """Return the manifest as plain data, without a list of own states that is empty."""
        return self.model_dump(mode="json", exclude=None if self.own_states else {"own_states"})

    def fits(self, plan: "Plan | Manifest") -> bool:
        """Whether a plan of the same identity has these members, this engine and these traces."""
        return (self.members, self.engine, self.keep) == (plan.members, plan.engine, plan.keep)


def read_manifest(folder: Path) -> Manifest:
    """Read the manifest of a folder.

    Raises:
        NotAResultError: It is not the folder of a sweep, or its manifest is damaged.
        StoreError: It cannot be read, or was written by a newer rbstab.
    """
    path = folder / MANIFEST
    if not path_exists(path):
        why = "" if path_exists(folder) else ": there is no such folder"
        raise NotAResultError(f"{folder} is not the folder of a sweep{why}")
    data = read_document(path)
    version = data.get("schema_version")
    if version == 1:
        raise NotAResultError(
            f"{folder} was written by an older rbstab; run the sweep in a new folder"
        )
    if type(version) is int and version > MANIFEST_VERSION:
        raise StoreError(f"{folder} was written by a newer rbstab; update rbstab")
    if version != MANIFEST_VERSION:
        raise NotAResultError(f"{path} is damaged: schema_version is wrong")
    manifest = checked(path, data, Manifest)
    known = known_columns() | final_columns(manifest.states)
    unknown = [name for name in manifest.columns if name not in known]
    if unknown:
        raise StoreError(
            f"{folder} has columns of a newer rbstab ({', '.join(unknown)}); update rbstab"
        )
    if manifest.engine not in ENGINES:
        raise StoreError(
            f"{folder} was computed by the engine {manifest.engine}, which this rbstab does not "
            "have; update rbstab"
        )
    return manifest
