"""What a file or folder is that a user named, told by its place, its ending, or else its text."""

from enum import StrEnum
from pathlib import Path

from rbstab.config.errors import ConfigError
from rbstab.config.load import source_of
from rbstab.config.source import YAML
from rbstab.experiment.proof_cache import BOUND, PROOFS, WITHIN_TOLERANCES
from rbstab.files.text import shell_word
from rbstab.store.disk.paths import path_is_dir, path_is_file
from rbstab.sweep.folder.manifest import MANIFEST
from rbstab.sweep.folder.sweep_folder import SHARDS, SWEEP_FILE, TRACES
from rbstab.sweep.plan.load import is_config, is_plan

RESULT = ".h5"


class Kind(StrEnum):
    """What a path leads to."""

    RUN = "run"
    SWEEP = "sweep"
    PART = "part of a sweep"
    PROOF = "proof of rest states"
    BOUND = "proof of a bound on disturbances"
    TOLERANCES = "proof within tolerances"
    PROOFS = "folder of proofs"
    FOLDER = "folder"
    CONFIG = "config"
    PLAN = "plan of a sweep"
    YAML = "YAML file"

    @property
    def words(self) -> str:
        """Its name in a sentence."""
        named = {Kind.RUN: "the result of a run", Kind.PLAN: "the plan of a sweep"}
        return named.get(self, f"a {self}")


COMMANDS = {
    Kind.CONFIG: "Run it: rbstab run",
    Kind.PLAN: "Run it: rbstab sweep",
    **dict.fromkeys(
        (Kind.PROOF, Kind.BOUND, Kind.TOLERANCES, Kind.PROOFS), "Look at it: rbstab show"
    ),
    Kind.PART: "Name the sweep:",
}
"""What to do with what is not a result."""


def kind_of(path: Path) -> Kind:
    """Return the kind of a path.

    Other files count as the result of a run: reading them says what is wrong.

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
    if path.name in (SWEEP_FILE, MANIFEST) and path_is_file(folder / MANIFEST):
        return Kind.SWEEP if path.name == SWEEP_FILE else Kind.PART
    if path.suffix == ".json" and folder.name == PROOFS:
        others = Kind.BOUND if path.name.startswith(BOUND) else Kind.PROOF
        return Kind.TOLERANCES if path.name.startswith(WITHIN_TOLERANCES) else others
    if path.suffix.lower() in (RESULT, ".json") or not path_is_file(path):
        return Kind.RUN
    return _told_by_text(path)


def _told_by_text(path: Path) -> Kind:
    """Return what a file is, told by its text as YAML; a config may have any name."""
    is_yaml = path.suffix.lower() in YAML
    try:
        data = source_of(path).data
        if is_plan(data):
            return Kind.PLAN
        return Kind.CONFIG if is_yaml or is_config(data) else Kind.RUN
    except ConfigError:
        return Kind.YAML if is_yaml else Kind.RUN


def not_a_result(path: Path, kind: Kind) -> str:
    """Return what a path is that is not a result, and what to do with it."""
    named = sweep_folder_of(path) if kind is Kind.PART else path
    command = f". {COMMANDS[kind]} {shell_word(named)}" if kind in COMMANDS else ""
    return f"{path} is {kind.words}, not a result{command}"


def sweep_folder_of(path: Path) -> Path:
    """Return the folder of a sweep that a path of one of the kinds of sweeps belongs to.

    Raises:
        StoreError: The path cannot be tested.
    """
    for folder in (path, path.parent, path.parent.parent):
        if path_is_file(folder / MANIFEST):
            return folder
    return path.absolute().parent.parent
