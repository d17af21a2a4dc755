"""The content of files of results, read without the code under test."""

import hashlib
import json
import re
from urllib.parse import unquote

import h5py
import numpy as np
from support.results import sealed

from rbstab.store.disk.atomic import PARTIAL_SUFFIX
from rbstab.store.disk.seal import SEAL_SIZE

Content = dict[str, str]
"""The entries of a file by name, such as its arrays, each as a digest or a short text."""

Folder = dict[str, str]
"""The digest of the bytes of each file, by its path in the folder."""

VOLATILE = frozenset(
    {
        *("@commit", "@created", "@wall_time", "@convergence_wall_time", "@digest"),
        *("seconds", "digest"),
    }
)
"""Attributes of HDF5 files, and keys of JSON files, that differ from run to run: they are blank."""

DATES = re.compile(rb"Date[(>][^)<]*|ID\[[^\]]*|ID>[^<]*")
"""Parts of a PDF that depend on the time."""

LINK = re.compile(r"!\[[^\]]*\]\(([^)]+\.svg)\)")
"""A picture in Markdown."""


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
            entries = _hdf5(path)
        elif path.suffix == ".json":
            data = json.loads(path.read_bytes())
            entries = {key: json.dumps(value) for key, value in data.items()}
        else:
            content = path.read_bytes()
            if path.suffix == ".pdf":
                content = DATES.sub(b"", content)
            entries = {"bytes": hashlib.sha256(content).hexdigest()}
    except (OSError, ValueError, LookupError, RuntimeError, AttributeError) as error:
        return {"unreadable": str(error)}
    return entries | dict.fromkeys(VOLATILE & entries.keys(), "")


def contents(folder):
    """Return the content of all files with final names."""
    return {
        str(path.relative_to(folder)): content_of(path)
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not path.name.startswith(".")
    }


def partial_files(folder):
    """Return the names of the partial files that writers have left."""
    return sorted(path.name for path in folder.rglob(f"*{PARTIAL_SUFFIX}"))


def missing_pictures(folder):
    """Yield the pictures that reports in Markdown show, but that do not exist."""
    for report in folder.glob("*.md"):
        for link in LINK.findall(report.read_text(encoding="utf-8")):
            if not (folder / unquote(link)).is_file():
                yield f"{report.name} shows {link}, which does not exist"


def differences(actual, expected):
    """Return the names of the entries that differ."""
    return [n for n in sorted(actual.keys() | expected.keys()) if actual.get(n) != expected.get(n)]


def _hdf5(path):
    content = path.read_bytes()
    entries = {"is sealed": str(content == sealed(content[:-SEAL_SIZE]))}
    with h5py.File(path, "r", locking=False) as file:

        def visit(name, entry):
            entries.update(_attributes(name, entry))
            if isinstance(entry, h5py.Dataset):
                data = np.asarray(entry[()])
                is_text = data.dtype == object
                content = repr(data.tolist()).encode() if is_text else data.tobytes()
                digest = hashlib.sha256(content).hexdigest()
                entries[name] = f"{data.dtype} {data.shape} {digest}"

        entries.update(_attributes("", file))
        file.visititems(visit)
    return entries


def _attributes(name, entry):
    # References to dimension scales are addresses in the file.
    hidden = ("REFERENCE_LIST", "DIMENSION_LIST")
    return {f"{name}@{key}": str(value) for key, value in entry.attrs.items() if key not in hidden}
