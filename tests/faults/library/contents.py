"""Compare folders of results by the content of their files, without the code under test."""

import hashlib
import json
import re

import h5py
import numpy as np

Content = dict[str, str]
"""The entries of a file by name, such as its arrays, each as a digest or a short text."""

Folder = dict[str, str]
"""The digest of the bytes of each file, by its path in the folder."""

VOLATILE = frozenset({"@commit", "@created", "@wall_time", "@digest", "seconds", "digest"})
"""Attributes of HDF5 files, and keys of JSON files, that differ from run to run."""

DATES = re.compile(rb"/CreationDate \([^)]*\)|/ID \[[^\]]*\]")
"""Parts of a PDF that depend on the time."""


def files_of(folder):
    """Return the files of a folder and its subfolders."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def content_of(path):
    """Return the content of a file, read by h5py or json; `unreadable` if it is not valid."""
    try:
        if path.suffix == ".h5":
            return _hdf5(path)
        if path.suffix == ".json":
            data = json.loads(path.read_bytes())
            return {key: json.dumps(value) for key, value in data.items()}
    except (OSError, ValueError, LookupError, RuntimeError, AttributeError) as error:
        return {"unreadable": str(error)}
    content = path.read_bytes()
    if path.suffix == ".pdf":
        content = DATES.sub(b"", content)
    return {"bytes": hashlib.sha256(content).hexdigest()}


def equal(found, expected):
    """Whether two contents have the same entries; of `VOLATILE` entries only the names count."""
    return found.keys() == expected.keys() and not differences(found, expected)


def differences(found, expected):
    """Return the names of the entries that differ."""
    names = found.keys() | expected.keys()
    return [n for n in sorted(names - VOLATILE) if found.get(n) != expected.get(n)]


def _hdf5(path):
    found = {}
    with h5py.File(path, "r", locking=False) as file:

        def visit(name: str, entry: h5py.Group | h5py.Dataset) -> None:
            found.update(_attributes(name, entry))
            if isinstance(entry, h5py.Dataset):
                data = np.asarray(entry[()])
                is_text = data.dtype == object
                content = repr(data.tolist()).encode() if is_text else data.tobytes()
                digest = hashlib.sha256(content).hexdigest()
                found[name] = f"{data.dtype} {data.shape} {digest}"

        found.update(_attributes("", file))
        file.visititems(visit)
    return found


def _attributes(name, entry):
    # References to dimension scales are addresses in the file.
    hidden = ("REFERENCE_LIST", "DIMENSION_LIST")
    return {f"{name}@{key}": str(value) for key, value in entry.attrs.items() if key not in hidden}
