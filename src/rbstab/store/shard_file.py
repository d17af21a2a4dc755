"""Shards of a sweep: files of consecutive members that are fast to write and to read.

There are many shards. HDF5 needs more time for the metadata of a file than a processor needs to
integrate a hundred members. So a shard has numpy's own format, which `numpy.load` opens: a
structured array with one entry for each member, described in `results/README.md`. A line of JSON
with the attributes follows, and then the seal.
"""

import io
import json
import re
from pathlib import Path

import numpy as np

from rbstab.store.disk.atomic import write_atomically
from rbstab.store.disk.seal import add_seal, read_sealed, seal_digest
from rbstab.store.errors import NewerSchemaError, NotAResultError, StoreError
from rbstab.store.table import RUN, Arrays, Layout, Table, TableHeader, check_columns
from rbstab.store.variables import check_shape

SHARD_VERSION = 1
"""The format version that this program writes, and the newest that it reads."""

SHARD_SUFFIX = ".npy"
"""The suffix of shards."""

MAX_ATTRIBUTE_BYTES = 1 << 16
"""The largest size of the attributes of a shard."""

_NUMPY_MAGIC = b"\x93NUMPY\x01\x00"
"""The first bytes of a file in numpy's format, version 1. The length of the header follows."""

_HEADER = re.compile(
    rb"\{'descr': (?P<type>\[.*\]), 'fortran_order': False, "
    rb"'shape': \((?P<length>[0-9]{1,12}),\), \} *\n"
)

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
    start, length = _read_header(path, content, layout)
    entry_type = _entry_type(layout)
    end = start + length * entry_type.itemsize
    if end > len(content):
        raise NotAResultError(f"{path} is damaged: it has fewer members than its header says")
    attributes = _read_attributes(path, content[end:])
    # Copied: numpy cannot write to bytes.
    entries = np.frombuffer(content, entry_type, length, start).copy()
    arrays = {name: entries[name] for name in (RUN, *layout)}
    try:
        check_columns(layout, arrays)
    except ValueError as error:
        raise NotAResultError(f"{path} is damaged: {error}") from error
    return Table(layout, arrays, attributes | {DIGEST: digest})


def _read_header(path: Path, content: bytes, layout: Layout) -> tuple[int, int]:
    """Read numpy's header of a shard; return where the entries start, and their number.

    numpy's own function would evaluate the text of the header, which may be hostile, and make an
    array of any length that the header names.
    """
    text_start = len(_NUMPY_MAGIC) + 2
    length = int.from_bytes(content[len(_NUMPY_MAGIC) : text_start], "little")
    found = _HEADER.fullmatch(content[text_start : text_start + length])
    if not content.startswith(_NUMPY_MAGIC) or found is None:
        raise NotAResultError(f"{path} is not a shard of a sweep")
    if found["type"] != repr(_entry_type(layout).descr).encode():
        raise NotAResultError(f"{path} has other columns than a shard of this rbstab")
    return text_start + length, int(found["length"])


def _read_attributes(path: Path, content: bytes) -> dict[str, str | int | float]:
    """Read the attributes of a shard, and check its version."""
    try:
        if len(content) > MAX_ATTRIBUTE_BYTES:
            raise ValueError("too long")
        attributes = json.loads(content.decode())
        version = attributes.pop("schema_version")
    except (ValueError, KeyError, AttributeError, TypeError, RecursionError) as error:
        raise NotAResultError(f"{path} is not a shard of a sweep") from error
    if type(version) is not int or not all(
        type(v) in (str, int, float) for v in attributes.values()
    ):
        raise NotAResultError(f"{path} is damaged: its attributes have wrong types")
    if version > SHARD_VERSION:
        raise NewerSchemaError(f"{path} was written by a newer rbstab; update rbstab")
    return dict(attributes)


def _entry_type(layout: Layout) -> np.dtype[np.void]:
    fields: list[tuple[str, str, tuple[int, ...]]] = [(RUN, "<i8", ())]
    for name, column in layout.items():
        fields.append((name, np.dtype(column.dtype).newbyteorder("<").str, column.shape))
    return np.dtype(fields)
