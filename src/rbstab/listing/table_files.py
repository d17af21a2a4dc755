"""Files of flat columns: CSV, Parquet, and the .mat files of MATLAB."""

import csv
from collections.abc import Callable, Iterator
from io import BytesIO, StringIO
from pathlib import Path

from rbstab.store.disk.atomic import atomic_file, write_all
from rbstab.store.variables import FlatColumns, frame_of

NETCDF = "nc"
"""The ending of a file of a whole sweep, whose arrays are not flat."""

_BLOCK = 4096
"""Rows of a CSV file that are made at once."""


def write_columns(path: Path, columns: FlatColumns, form: str, *, replace: bool = False) -> None:
    """Write a file with a row for each entry of the columns; it appears when it is complete.

    Numbers keep all their bits. Parquet files have the units, as `pandas.DataFrame.attrs`.

    Args:
        path: The file; its folder must exist.
        columns: The columns.
        form: One of `FORMS`.
        replace: Whether an existing file is replaced.

    Raises:
        ResultExistsError: The file exists and `replace` is not set.
        ImportError: A package is not installed.
        OSError: The file cannot be written.
    """
    with atomic_file(path, replace=replace) as file:
        for piece in FORMS[form](columns):
            write_all(file, piece)


def _csv(columns: FlatColumns) -> Iterator[bytes]:
    arrays = list(columns.arrays.values())
    yield _csv_lines([list(columns.arrays)])
    for start in range(0, len(arrays[0]), _BLOCK):
        # Of a float, `csv` writes the shortest digits that are read back as the same float.
        rows = zip(*(array[start : start + _BLOCK].tolist() for array in arrays), strict=True)
        yield _csv_lines(list(rows))


def _csv_lines(rows: list[list[str]] | list[tuple[object, ...]]) -> bytes:
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue().encode("utf-8", "backslashreplace")


def _parquet(columns: FlatColumns) -> Iterator[memoryview]:
    content = BytesIO()
    frame_of(columns, next(iter(columns.arrays))).to_parquet(content, engine="pyarrow")
    yield content.getbuffer()


def _mat(columns: FlatColumns) -> Iterator[memoryview]:
    # Imported late: CSV needs no SciPy.
    from scipy.io import savemat

    content = BytesIO()
    savemat(content, columns.arrays, oned_as="column")
    yield content.getbuffer()


FORMS: dict[str, Callable[[FlatColumns], Iterator[bytes | memoryview]]] = {
    "csv": _csv,
    "parquet": _parquet,
    "mat": _mat,
}
"""The writers of the forms, by the endings of their files."""
