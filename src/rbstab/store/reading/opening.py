"""Opening HDF5 files; all errors of reading become store errors."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import h5py

from rbstab.store.disk.checked_reads import CheckedReads
from rbstab.store.disk.regular_file import open_regular
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.store.reading.hdf5_reader import Hdf5Reader
from rbstab.store.reading.raw_arrays import RawArrays
from rbstab.store.reading.text_heaps import find_texts


@contextmanager
def open_hdf5(path: Path) -> Iterator[Hdf5Reader]:
    """Return a context with an HDF5 file open for reading; all errors become store errors.

    HDF5 reads through a Python file object. So it needs no lock, which network file systems often
    do not have. Other programs and other parts of this process may have the file open too.

    Raises:
        NotAResultError: The file is damaged, or is not HDF5.
        StoreError: The file cannot be opened.
    """
    with _open_raw(path) as raw:
        checked = CheckedReads(raw)
        try:
            texts = find_texts(raw)
            if texts is None:
                raise NotAResultError(f"{path} is damaged: its texts are not as HDF5 stores them")
            with h5py.File(checked, "r") as file:
                yield Hdf5Reader(file, RawArrays(path, raw, texts, file.userblock_size))
            checked.raise_error()
        except Exception as error:
            # A file that cannot be read now may be whole, so a failed read is not called damage.
            raise _store_error(path, checked.error or error) from error


def _store_error(path: Path, error: Exception) -> StoreError:
    """Return the store error for an error of reading.

    h5py raises many kinds for files that are not as they should be. Their texts help no user: they
    name functions of HDF5.
    """
    if isinstance(error, StoreError):
        return error
    if isinstance(error, OSError):
        if error.errno is not None:
            return _unreadable(path, error)
        return NotAResultError(f"{path} is damaged or is not HDF5")
    if isinstance(error, MemoryError):
        return StoreError(f"{path} needs more memory than there is")
    return NotAResultError(f"{path} is damaged: HDF5 cannot read it")


def _unreadable(path: Path, error: OSError) -> StoreError:
    return StoreError(f"{path} cannot be read: {error.strerror or error}")


@contextmanager
def _open_raw(path: Path) -> Iterator[BinaryIO]:
    """Return a context with a file open for reading; an error of closing it is a store error."""
    file = open_regular(path)
    try:
        yield file
    finally:
        try:
            file.close()
        except OSError as error:
            raise _unreadable(path, error) from error
