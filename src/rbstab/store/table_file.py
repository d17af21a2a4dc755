"""Files with columns of runs: the shards of a sweep, and what is known of all of its members."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbstab.store.dataset_file import Attributes, Dataset, read_dataset, write_dataset
from rbstab.store.errors import NotAResultError
from rbstab.store.table import AXES, Arrays, Column, Layout, Table, check_columns
from rbstab.store.variables import RUN, Variable

SHARD = "a shard of a sweep"


DIGEST = "digest"
"""The attribute of a table that was read with the digest in the seal of its file."""


def write_table(  # noqa: PLR0913, PLR0917 (the parts of a table)
    path: Path,
    kind: str,
    layout: Layout,
    arrays: Arrays,
    attributes: Attributes,
    extras: Mapping[str, Variable] | None = None,
) -> str:
    """Write columns of runs to a file atomically; an existing file is replaced.

    Args:
        path: The file.
        kind: What it is.
        layout: The columns.
        arrays: Their data, and `run`, the numbers of the runs.
        attributes: Texts and numbers.
        extras: Arrays without the dimension `run`.

    Returns:
        The digest in the seal of the file.

    Raises:
        StoreError: The file cannot be written, or an array has a wrong shape.
    """
    numbers = Variable((RUN,), arrays[RUN], "1", "number of the run")
    columns = {
        name: Variable(
            (RUN, *column.dimensions),
            np.asarray(arrays[name], column.dtype),
            *(column.unit, column.long_name, column.flags),
        )
        for name, column in layout.items()
    }
    dataset = Dataset(kind, {RUN: numbers, **columns, **(extras or {})}, attributes)
    return write_dataset(path, dataset, replace=True).digest


def read_table(path: Path, kind: str, names: Iterable[str] | None = None) -> Table:
    """Read columns of runs.

    Args:
        path: The file.
        kind: What it must be.
        names: The columns to read; default all. Arrays without the dimension `run` are all read.

    Raises:
        NotAResultError: The file is damaged, or is not of this kind.
        NewerSchemaError: The file was written by a newer rbstab.
        StoreError: The file cannot be opened.
    """
    found = read_dataset(path, kind, names)
    layout, arrays, extras = dict[str, Column](), dict[str, NDArray[Any]](), dict[str, Variable]()
    for name, one in found.variables.items():
        if one.dimensions[:1] != (RUN,):
            extras[name] = one
            continue
        arrays[name] = one.data
        if name != RUN:
            lengths = () if all(n == AXES for n in one.data.shape[1:]) else one.data.shape[1:]
            dtype = one.data.dtype.str.lstrip("<|")
            layout[name] = Column(one.dimensions[1:], dtype, *one[2:], lengths)
    try:
        check_columns(layout, arrays)
    except (KeyError, ValueError) as error:
        raise NotAResultError(f"{path} is damaged: {error}") from error
    return Table(layout, arrays, {**found.attributes, DIGEST: found.digest}, extras)
