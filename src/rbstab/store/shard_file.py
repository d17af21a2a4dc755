"""Shards of a sweep: some consecutive runs in a file that is quick to write and to read.

There are many of them, and HDF5 takes longer to name what is in a file than a processor to follow a
hundred members. So a shard is in numpy's own format, and `numpy.load` opens it: a structured array
with an entry for each run, described in `results/README.md`. Behind it stand a line of JSON, with
what else is known, and the seal.
"""

import io
import json
from pathlib import Path

import numpy as np

from rbstab.store.atomic import write_atomically
from rbstab.store.errors import NewerSchemaError, NotAResultError, StoreError
from rbstab.store.seal import digest_in, sealed, unsealed
from rbstab.store.table import RUN, Arrays, Head, Layout, Table

SHARD_VERSION = 1
"""The version of the format that this program writes, and the newest that it reads."""

SHARD = ".npy"
"""How the names of shards end."""

DIGEST = "digest"
"""The attribute of a shard that was read with the digest of all that is in it."""


def write_shard(path: Path, head: Head, arrays: Arrays) -> str:
    """Writes some runs in place of what stood there; the file appears whole or not at all.

    Args:
        path: The file; its folder must exist.
        head: All but the data of the columns; it has no extras.
        arrays: These.

    Returns:
        The digest of the file's content.

    Raises:
        StoreError: The operating system refused.
    """
    entries = np.empty(head.length, dtype=_type_of(head.layout))
    entries[RUN] = np.arange(head.first, head.first + head.length)
    for name in head.layout:
        entries[name] = arrays[name]
    file = io.BytesIO()
    np.lib.format.write_array(file, entries, allow_pickle=False)
    known = {"schema_version": SHARD_VERSION, **head.attributes}
    file.write(b"\n" + json.dumps(known, sort_keys=True).encode())
    content = sealed(file.getvalue())
    try:
        write_atomically(path, content, replace=True)
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error.strerror or error}") from error
    return digest_in(content)


def read_shard(path: Path, layout: Layout) -> Table:
    """Reads a shard.

    Args:
        path: The file.
        layout: Its columns.

    Returns:
        The runs; the attributes have the digest of the file's content besides what was written.

    Raises:
        NotAResultError: It is damaged, or no shard with these columns.
        NewerSchemaError: It was written by a newer rbstab.
        StoreError: It cannot be opened.
    """
    content, digest = unsealed(path)
    file = io.BytesIO(content)
    try:
        entries = np.lib.format.read_array(file, allow_pickle=False)
        known = json.loads(file.read())
        version = known.pop("schema_version")
    except (ValueError, EOFError, KeyError, AttributeError, TypeError) as error:
        raise NotAResultError(f"{path} is no shard of a sweep") from error
    if version > SHARD_VERSION:
        raise NewerSchemaError(f"{path} was written by a newer rbstab, please update")
    if entries.dtype != _type_of(layout) or entries.ndim != 1:
        raise NotAResultError(f"{path} has other columns than a shard of this rbstab")
    arrays = {name: entries[name] for name in (RUN, *layout)}
    return Table(layout, arrays, known | {DIGEST: digest})


def _type_of(layout: Layout) -> np.dtype[np.void]:
    fields: list[tuple[str, str, tuple[int, ...]]] = [(RUN, "<i8", ())]
    for name, column in layout.items():
        fields.append((name, np.dtype(column.dtype).newbyteorder("<").str, column.shape))
    return np.dtype(fields)
