"""Reading HDF5 files that may be damaged, or somebody else's."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from rbstab.store.errors import NewerSchemaError, NotAResultError, StoreError


@contextmanager
def opened(path: Path) -> Iterator[h5py.File]:
    """An HDF5 file for reading; what goes wrong inside is told as an error of the store.

    Raises:
        NotAResultError: It is damaged, or not HDF5.
        StoreError: It cannot be opened.
    """
    try:
        # A result never changes once it has its name, so it needs no lock, which network file
        # systems often refuse.
        with path.open("rb"), h5py.File(path, "r", locking=False) as file:
            yield file
    except StoreError:
        raise
    except OSError as error:
        if error.errno is not None:
            raise StoreError(f"{path} cannot be read: {error.strerror}") from error
        raise NotAResultError(f"{path} is damaged or is not HDF5") from error
    except (LookupError, ValueError, RuntimeError, TypeError, MemoryError) as error:
        raise NotAResultError(f"{path} is damaged: {error}") from error


def check_version(path: Path, file: h5py.File, newest: int) -> None:
    """Refuses a file that is none of ours, or of a newer format.

    Raises:
        NotAResultError: It has no schema version.
        NewerSchemaError: It has one above `newest`.
    """
    version = file.attrs.get("schema_version")
    if not isinstance(version, int | np.integer) or version < 1:
        raise NotAResultError(f"{path} is HDF5, but no result of rbstab")
    if version > newest:
        raise NewerSchemaError(
            f"{path} has schema version {version}, this rbstab knows up to {newest}: "
            "it was written by a newer rbstab, please update"
        )


def array_of(path: Path, file: h5py.File, name: str) -> h5py.Dataset:
    """An array of a file.

    Raises:
        NotAResultError: What has the name is not an array of this file.
    """
    link = file.get(name, getlink=True)
    dataset = file[name] if isinstance(link, h5py.HardLink) else None
    if not isinstance(dataset, h5py.Dataset) or dataset.is_virtual or dataset.external:
        # rbstab writes none of these, and a file that leads to others is not read.
        raise NotAResultError(f"{path}: {name} is not an array of this file")
    return dataset


def plain(value: Any) -> Any:
    """The value of an attribute as Python's own number or text."""
    return value.item() if isinstance(value, np.generic) else value
