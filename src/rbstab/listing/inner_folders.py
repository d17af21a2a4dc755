"""What a folder of proofs holds, and the folders of shards and of traces in a sweep."""

from collections import defaultdict
from pathlib import Path

from rbstab.experiment.proof_cache import proof_file
from rbstab.experiment.stored_config import stored_config
from rbstab.listing.folder import proofs_in, results_in
from rbstab.listing.kinds import Kind, kind_of
from rbstab.listing.proofs import what_it_says
from rbstab.processes.mapped import mapped
from rbstab.report.model.words import listed
from rbstab.store.disk.paths import path_is_file
from rbstab.store.errors import StoreError
from rbstab.store.result import open_result
from rbstab.sweep.folder.sweep_folder import SweepFolder, read_folder

MAX_TITLES = 3
"""The most titles that are named beside a proof."""

SENTENCES = 2
"""As many sentences of a proof: its rest states, and whether all motions end in one."""


def rows_of(path: Path, kind: Kind) -> list[dict[str, str]]:
    """Return what one of `INNER_FOLDERS` holds, as rows of a table.

    Raises:
        StoreError: It cannot be read.
    """
    if kind is Kind.PROOFS:
        # The parent of a relative path `proofs` is the working folder.
        return _proof_rows(path.absolute().parent)
    return _sweep_rows(read_folder(path.absolute().parent), is_shards=kind is Kind.SHARDS)


def _proof_rows(results: Path) -> list[dict[str, str]]:
    """Return the proofs in a folder of results, each with the titles of the runs beside it.

    A proof that cannot be read has the reason in place of what it says.
    """
    titles = _titles_by_proof(results)
    rows = []
    for file in proofs_in(results):
        try:
            says = " ".join(what_it_says(file).sentences[:SENTENCES])
        except StoreError as error:
            says = str(error)
        of = listed(titles[file.name], MAX_TITLES) or "-"
        rows.append({"proof": file.name, "of": of, "says": says})
    return rows


def _titles_by_proof(folder: Path) -> dict[str, dict[str, None]]:
    """Return the titles of the runs in a folder by the names of the files of their proofs."""
    found: defaultdict[str, dict[str, None]] = defaultdict(dict)
    runs = [path for path in results_in(folder) if kind_of(path) is Kind.RUN]
    for title, name in mapped(_proof_of_run, runs):
        found[name][title] = None
    return found


def _proof_of_run(path: Path) -> tuple[str, str]:
    """Return the title of a run, and the name that the file of its proof has; "" if unknown."""
    try:
        result = open_result(path)
    except StoreError:
        return "", ""
    config = stored_config(result).config
    name = "" if config is None else proof_file(path.parent, config).name
    return str(result.attributes["title"]), name


def _sweep_rows(folder: SweepFolder, *, is_shards: bool) -> list[dict[str, str]]:
    """Return the stored shards of a sweep with their members, or those of them with traces."""
    rows = []
    for number in sorted(folder.stored_shards()):
        file = folder.shard_file(number) if is_shards else folder.traces_file(number)
        if path_is_file(file):
            first, stop = folder.bounds(number)
            rows.append({"file": file.name, "members": f"{first} to {stop - 1}"})
    return rows
