"""The kinds of files and folders that a user may name, told by where they are and how they end."""

from enum import StrEnum
from pathlib import Path

from rbstab.config.source import YAML
from rbstab.experiment.proof_cache import PROOFS
from rbstab.store.disk.paths import path_is_dir, path_is_file
from rbstab.sweep.folder.manifest import MANIFEST
from rbstab.sweep.folder.sweep_folder import SHARDS, SWEEP_FILE, TRACES


class Kind(StrEnum):
    """What a path leads to."""

    RUN = "run"
    SWEEP = "sweep"
    PART = "part of a sweep"
    PROOF = "proof"
    CONFIG = "config or plan"
    FOLDER = "folder"
    PROOFS = "folder of proofs"


def kind_of(path: Path) -> Kind:
    """Return the kind of a path; a file of an unknown kind is treated as a run.

    Raises:
        StoreError: The path cannot be tested.
    """
    whole = path.absolute()
    folder = whole.parent
    for part in (whole, folder):
        if part.name in (SHARDS, TRACES) and path_is_file(part.parent / MANIFEST):
            return Kind.PART
    if path_is_dir(path):
        kind = Kind.PROOFS if whole.name == PROOFS else Kind.FOLDER
        return Kind.SWEEP if path_is_file(path / MANIFEST) else kind
    if path.name == SWEEP_FILE and path_is_file(folder / MANIFEST):
        return Kind.SWEEP
    if path.suffix == ".json" and folder.name == PROOFS:
        return Kind.PROOF
    is_yaml = path.suffix.lower() in YAML and path_is_file(path)
    return Kind.CONFIG if is_yaml else Kind.RUN


def sweep_folder_of(path: Path) -> Path:
    """Return the folder of a sweep that a path of one of the kinds of sweeps belongs to.

    Raises:
        StoreError: The path cannot be tested.
    """
    for folder in (path, path.parent):
        if path_is_file(folder / MANIFEST):
            return folder
    return path.parent.parent
