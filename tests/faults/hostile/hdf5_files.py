"""Hostile HDF5 files, each made from a good one by a small function; `KINDS` has their names."""

from pathlib import Path

import h5py
from faults.hostile import objects, raw_bytes, sizes, texts, types
from faults.hostile.registry import BYTES, CONTENTS

from rbstab.store.disk.seal import SEAL_SIZE, add_seal

MODULES = (sizes, objects, types, texts, raw_bytes)
"""Importing them fills the registry."""

KINDS = (*CONTENTS, *BYTES)


def write_hostile(kind: str, good: Path, array: str, path: Path, *, sealed: bool) -> None:
    """Write a hostile file.

    Args:
        kind: One of `KINDS`.
        good: A good file with a seal.
        array: The name of an array of floats in it.
        path: The file to write.
        sealed: Whether it gets a right seal; otherwise it has none.
    """
    content = good.read_bytes()[:-SEAL_SIZE]
    if kind in BYTES:
        content = BYTES[kind](content)
    else:
        path.write_bytes(content)
        with h5py.File(path, "r+") as file:
            CONTENTS[kind](file, array)
        content = path.read_bytes()
    path.write_bytes(add_seal(content) if sealed else content)
