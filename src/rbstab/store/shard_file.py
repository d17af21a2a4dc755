"""Shards of a sweep: files of consecutive members that are fast to write and to read.

There are many shards. HDF5 needs more time for the metadata of a file than a processor needs to
integrate a hundred members. So a shard has numpy's own format, which `numpy.load` opens: a
structured array with one entry for each member, described in `results/README.md`. A line of JSON
with the attributes follows, and then the seal.
"""

import io
import json
from pathlib import Path

import numpy as np

from rbstab.store.atomic import write_atomically
from rbstab.store.errors import NewerSchemaError, NotAResultError, StoreError
from rbstab.store.seal import add_seal, read_sealed, seal_digest
from rbstab.store.table import RUN, Arrays, Layout, Table, TableHeader, check_shape

SHARD_VERSION = 1
"""The format version that this program writes, and the newest that it reads."""

SHARD_SUFFIX = ".npy"
"""The suffix of shards."""

DIGEST = "digest"
"""The attribute with the digest of the content of a shard; added when the shard is read."""


def write_shard(path: Path, header: TableHeader, arrays: Arrays) -> str:
    """Write a shard atomically.

    Args:
        path: The file; it is replaced, and its folder must exist.
        header: The header of the table, without extras.
        arrays: The data of the columns.

    Returns:
        The digest of the content of the file.

    Raises:
        StoreError: The file cannot be written.
    """
    entries = np.empty(header.length, dtype=_entry_type(header.layout))
    entries[RUN] = np.arange(header.first, header.first + header.length)
    for name in header.layout:
        # Otherwise numpy would silently broadcast a single number along an axis.
        check_shape(name, arrays[name], entries[name].shape)
        entries[name] = arrays[name]
    file = io.BytesIO()
    np.lib.format.write_array(file, entries, allow_pickle=False)
    attributes = {"schema_version": SHARD_VERSION, **header.attributes}
    file.write(b"\n" + json.dumps(attributes, sort_keys=True).encode())
    content = add_seal(file.getvalue())
    try:
        write_atomically(path, content, replace=True)
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error.strerror or error}") from error
    return seal_digest(content)


def read_shard(path: Path, layout: Layout) -> Table:
    """Read a shard.

    Args:
        path: The file.
        layout: The columns of the shard.

    Returns:
        The members; the attributes also have the digest of the content of the file.

    Raises:
        NotAResultError: The file is damaged, or is not a shard with these columns.
        NewerSchemaError: The file was written by a newer rbstab.
        StoreError: The file cannot be opened.
    """
    content, digest = read_sealed(path)
    file = io.BytesIO(content)
    try:
        entries = np.lib.format.read_array(file, allow_pickle=False)
        attributes = json.loads(file.read())
        version = attributes.pop("schema_version")
    except (ValueError, EOFError, KeyError, AttributeError, TypeError) as error:
        raise NotAResultError(f"{path} is not a shard of a sweep") from error
    if version > SHARD_VERSION:
        raise NewerSchemaError(f"{path} was written by a newer rbstab; update rbstab")
    if entries.dtype != _entry_type(layout) or entries.ndim != 1:
        raise NotAResultError(f"{path} has other columns than a shard of this rbstab")
    arrays = {name: entries[name] for name in (RUN, *layout)}
    return Table(layout, arrays, attributes | {DIGEST: digest})


def _entry_type(layout: Layout) -> np.dtype[np.void]:
    fields: list[tuple[str, str, tuple[int, ...]]] = [(RUN, "<i8", ())]
    for name, column in layout.items():
        fields.append((name, np.dtype(column.dtype).newbyteorder("<").str, column.shape))
    return np.dtype(fields)
