"""Files of motions of several runs, described in `results/README.md`."""

from pathlib import Path

from rbstab.store.dataset_file import Checksum, Dataset, read_dataset, write_dataset
from rbstab.store.motions import Motions

KIND = "a file of traces of a sweep"


def write_motions(path: Path, motions: Motions) -> Checksum:
    """Write motions to a file atomically; an existing file is replaced.

    Raises:
        StoreError: The file cannot be written.
    """
    return write_dataset(path, Dataset(KIND, motions.variables, motions.attributes), replace=True)


def read_motions(path: Path, row: int | None = None, *, checked: bool = False) -> Motions:
    """Read motions.

    Args:
        path: The file.
        row: The index of the only run to read; default all runs.
        checked: Whether the file was compared with its seal before.

    Raises:
        NotAResultError: The file is damaged, or has no motions.
        NewerSchemaError: The file was written by a newer rbstab.
        StoreError: The file cannot be opened.
    """
    found = read_dataset(path, KIND, row=row, checked=checked)
    return Motions(found.variables, found.attributes)
