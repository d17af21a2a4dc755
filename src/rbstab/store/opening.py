"""Reading HDF5 files that may be damaged or written by other programs."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from rbstab.store.errors import NewerSchemaError, NotAResultError, StoreError


@contextmanager
def open_hdf5(path: Path) -> Iterator[h5py.File]:
    """Return a context with an HDF5 file open for reading; HDF5 errors become store errors.

    Raises:
        NotAResultError: The file is damaged, or is not HDF5.
        StoreError: The file cannot be opened.
    """
    try:
        # A complete result never changes, so reading it needs no lock. Network file systems often
        # have no locks.
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
    """Refuse a file that is not a result of rbstab, or has a newer format.

    Raises:
        NotAResultError: The file has no schema version.
        NewerSchemaError: Its schema version is above `newest`.
    """
    version = file.attrs.get("schema_version")
    if not isinstance(version, int | np.integer) or version < 1:
        raise NotAResultError(f"{path} is HDF5, but not a result of rbstab")
    if version > newest:
        raise NewerSchemaError(
            f"{path} was written by a newer rbstab (schema version {version}, this one reads up to "
            f"{newest}); update rbstab"
        )


def get_array(path: Path, file: h5py.File, name: str) -> h5py.Dataset:
    """Return an array of a file.

    Raises:
        NotAResultError: The name is not the name of an array in this file.
    """
    link = file.get(name, getlink=True)
    dataset = file[name] if isinstance(link, h5py.HardLink) else None
    if not isinstance(dataset, h5py.Dataset) or dataset.is_virtual or dataset.external:
        # rbstab never writes links to other files, and does not follow them.
        raise NotAResultError(f"{path}: {name} is not an array of this file")
    return dataset


def to_python(value: Any) -> Any:
    """Return the value of an attribute as a Python number or text."""
    return value.item() if isinstance(value, np.generic) else value
