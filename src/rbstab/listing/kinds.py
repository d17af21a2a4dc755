"""The kinds of files and folders that a user may name, told by where they are and how they end."""

from enum import StrEnum
from pathlib import Path

from rbstab.config.source import YAML
from rbstab.experiment.proof_cache import PROOFS
from rbstab.store.disk.paths import path_is_dir, path_is_file
from rbstab.sweep.folder.manifest import MANIFEST
from rbstab.sweep.folder.sweep_folder import FILE_SUFFIX, SHARDS, SWEEP_FILE, TRACES


class Kind(StrEnum):
    """What a path leads to."""

    RUN = "run"
    SWEEP = "sweep"
    SHARD = "shard of a sweep"
    TRACES = "traces of a sweep"
    PROOF = "proof"
    CONFIG = "config or plan"
    FOLDER = "folder"
    PROOFS = "stored proofs"
    SHARDS = "shards of a sweep"
    MOTIONS = "files with traces of a sweep"


INNER_FOLDERS = (Kind.PROOFS, Kind.SHARDS, Kind.MOTIONS)
"""Folders that the program makes inside of another one."""


def kind_of(path: Path) -> Kind:
    """Return the kind of a path; a file of an unknown kind is treated as a run.

    Raises:
        StoreError: The path cannot be tested.
    """
    folder, name = path.absolute().parent, path.absolute().name
    if path_is_dir(path):
        is_sweep = path_is_file(path / MANIFEST)
        inner = {PROOFS: Kind.PROOFS}
        if path_is_file(folder / MANIFEST):
            inner = {SHARDS: Kind.SHARDS, TRACES: Kind.MOTIONS}
        return Kind.SWEEP if is_sweep else inner.get(name, Kind.FOLDER)
    in_sweep = path_is_file(folder.parent / MANIFEST)
    if path.name == SWEEP_FILE and path_is_file(folder / MANIFEST):
        return Kind.SWEEP
    if in_sweep and folder.name == SHARDS and path.suffix == FILE_SUFFIX:
        return Kind.SHARD
    if in_sweep and folder.name == TRACES:
        return Kind.TRACES
    if path.suffix == ".json" and folder.name == PROOFS:
        return Kind.PROOF
    is_yaml = path.suffix.lower() in YAML and path_is_file(path)
    return Kind.CONFIG if is_yaml else Kind.RUN


def sweep_folder_of(path: Path) -> Path:
    """Return the folder of a sweep that a path of one of the kinds of sweeps belongs to.

    Raises:
        StoreError: The path cannot be tested.
    """
    if path_is_dir(path):
        return path
    return path.parent if path.name == SWEEP_FILE else path.parent.parent
