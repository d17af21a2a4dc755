"""The manifest of a sweep's folder: made once, never changed, and repeated by each shard."""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    StringConstraints,
    model_validator,
)

from rbstab.integrate.engines import ENGINES
from rbstab.store.disk.paths import path_exists
from rbstab.store.document import checked, digest_of, read_document
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.sweep.members.outcome import shard_columns
from rbstab.sweep.plan.plan import MAX_MEMBERS, MAX_TITLE_LENGTH, Plan
from rbstab.sweep.plan.plan_file import NO_TRACES, TraceSelection
from rbstab.systems.quantities import is_element_state

MANIFEST = "manifest.json"
"""The name of the file."""

MANIFEST_VERSION = 3
"""Before version 3, shards did not repeat the manifest."""

MAX_SHARDS = MAX_MEMBERS // 16
"""The most shards of a sweep. It allows the smallest default size of a shard for all sweeps."""

_MAX_INTEGER = 2**62
"""Shards may be larger than the sweep, and so may the distance between members with traces."""

REQUIRED = (
    *("status", "end_time", "settling_time", "final_orientation", "rest_orientation"),
    *("lyapunov_start", "energy_at_rest", "energy_residual", "energy_scale"),
)
"""The columns of every sweep: without them no outcome is known, and no proof applies."""

_Id = Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{32}$")]
_Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$", max_length=100)]
_Text = Annotated[str, StringConstraints(max_length=100)]
_Column = Annotated[
    str, StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z0-9_]+)?$", max_length=100)
]
"""The final value of an own state of a named element has a dot in its name."""


class Manifest(BaseModel):
    """The properties of a sweep that do not change while it runs.

    Attributes:
        plan_id: The identity of the plan.
        title: The title of the plan.
        members: The number of members.
        shard_size: Members of a shard; the last one may have fewer.
        engine: The name of the engine.
        versions: The versions of rbstab and its libraries when the sweep was started.
        columns: The columns of the shards, set by the version of rbstab that started the sweep.
        keep: The members with traces.
        schema_version: The version of the folder's format.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    plan_id: _Id
    title: Annotated[str, StringConstraints(max_length=MAX_TITLE_LENGTH)]
    members: int = Field(ge=1, le=MAX_MEMBERS)
    shard_size: int = Field(ge=1, le=_MAX_INTEGER)
    engine: _Name
    versions: Annotated[dict[_Name, _Text], Field(max_length=50)]
    columns: Annotated[tuple[_Column, ...], Field(max_length=1000)]
    keep: TraceSelection = NO_TRACES
    schema_version: int = MANIFEST_VERSION

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.shards > MAX_SHARDS:
            raise ValueError(f"{self.members} members in shards of {self.shard_size}")
        if len(set(self.columns)) != len(self.columns):
            raise ValueError("a column is listed twice")
        if missing := [name for name in REQUIRED if name not in self.columns]:
            raise ValueError(f"the column {missing[0]} is missing")
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
    def data(self) -> dict[str, Any]:
        """The manifest as plain data."""
        return self.model_dump(mode="json")

    def fits(self, plan: "Plan | Manifest") -> bool:
        """Whether a plan of the same identity has these members, this engine and these traces."""
        return (self.members, self.engine, self.keep) == (plan.members, plan.engine, plan.keep)


def read_manifest(folder: Path) -> tuple[Manifest, str]:
    """Read the manifest of a folder, and its id: the digest of its content.

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
    if version in range(1, MANIFEST_VERSION):
        raise NotAResultError(
            f"{folder} was written by an older rbstab; run the sweep in a new folder"
        )
    if type(version) is int and version > MANIFEST_VERSION:
        raise StoreError(f"{folder} was written by a newer rbstab; update rbstab")
    if version != MANIFEST_VERSION:
        raise NotAResultError(f"{path} is damaged: schema_version is wrong")
    manifest = checked(path, data, Manifest)
    _check_supported(folder, manifest)
    return manifest, digest_of(data)


def _check_supported(folder: Path, manifest: Manifest) -> None:
    """Check that this program has the columns and the engine of a sweep."""
    supported: Mapping[str, Any] = shard_columns()
    unknown = [
        name for name in manifest.columns if name not in supported and not is_element_state(name)
    ]
    if unknown:
        raise StoreError(
            f"{folder} has columns of a newer rbstab ({', '.join(unknown)}); update rbstab"
        )
    if manifest.engine not in ENGINES:
        raise StoreError(
            f"{folder} was computed by the engine {manifest.engine}, which this rbstab does not "
            "have; update rbstab"
        )
