"""What a folder of proofs holds, and the folders of shards and of traces in a sweep."""

from collections import defaultdict
from enum import StrEnum
from pathlib import Path

from rbstab.experiment.proof_cache import PROOFS, proof_file
from rbstab.experiment.stored_config import stored_config
from rbstab.listing.folder import proofs_in, results_in
from rbstab.listing.kinds import Kind, kind_of, sweep_folder_of
from rbstab.listing.proofs import what_it_says
from rbstab.processes.mapped import mapped
from rbstab.report.model.words import listed
from rbstab.store.disk.paths import path_is_file
from rbstab.store.errors import StoreError
from rbstab.store.result import open_result
from rbstab.sweep.folder.manifest import MANIFEST
from rbstab.sweep.folder.sweep_folder import SHARDS, TRACES, read_folder

MAX_TITLES = 3
"""The most titles that are named beside a proof."""

SENTENCES = 2
"""As many sentences of a proof: its rest states, and whether all motions end in one."""


class InnerFolder(StrEnum):
    """A folder that the program makes inside of another one."""

    PROOFS = "stored proofs"
    SHARDS = "shards of a sweep"
    TRACES = "traces of a sweep"


def inner_folder(path: Path) -> InnerFolder | None:
    """Return which folder a path leads to; None for others.

    Raises:
        StoreError: The path cannot be tested.
    """
    if kind_of(path) is not Kind.FOLDER:
        return None
    whole = path.absolute()
    if whole.name == PROOFS:
        return InnerFolder.PROOFS
    kinds = {SHARDS: InnerFolder.SHARDS, TRACES: InnerFolder.TRACES}
    return kinds.get(whole.name) if path_is_file(whole.parent / MANIFEST) else None


def proof_rows(path: Path) -> list[dict[str, str]]:
    """Return the proofs in a folder of proofs, each with the titles of the runs beside it.

    A proof that cannot be read has the reason in place of what it says.
    """
    # The parent of a relative path `proofs` is the working folder.
    titles = _titles_by_proof(path.absolute().parent)
    rows = []
    for file in proofs_in(path.absolute().parent):
        try:
            says = " ".join(what_it_says(file).sentences[:SENTENCES])
        except StoreError as error:
            says = str(error)
        rows.append(
            {"proof": file.name, "of": listed(titles[file.name], MAX_TITLES) or "-", "says": says}
        )
    return rows


def _titles_by_proof(folder: Path) -> dict[str, list[str]]:
    """Return the titles of the runs in a folder by the names of the files of their proofs."""
    found: defaultdict[str, dict[str, None]] = defaultdict(dict)

    runs = [path for path in results_in(folder) if kind_of(path) is Kind.RUN]
    for title, names in mapped(_proofs_of_run, runs):
        for name in names:
            found[name][title] = None
    return defaultdict(list, {name: list(titles) for name, titles in found.items()})


def _proofs_of_run(path: Path) -> tuple[str, list[str]]:
    """Return the title of a run, and the name that the file of its proof has, or none."""
    try:
        result = open_result(path)
    except StoreError:
        return "", []
    config = stored_config(result).config
    return str(result.attributes["title"]), [] if config is None else [
        proof_file(path.parent, config).name
    ]


def sweep_rows(path: Path) -> list[dict[str, str]]:
    """Return the stored shards of a sweep with their members, or those of them with traces.

    Args:
        path: The folder of the shards, or of the traces.

    Raises:
        StoreError: The sweep cannot be read.
    """
    folder = read_folder(sweep_folder_of(path.absolute() / "any"))
    is_shards = path.absolute().name == SHARDS
    rows = []
    for number in sorted(folder.stored_shards()):
        file = folder.shard_file(number) if is_shards else folder.traces_file(number)
        if not path_is_file(file):
            continue
        first, stop = folder.bounds(number)
        rows.append({"file": file.name, "members": f"{first} to {stop - 1}"})
    return rows
