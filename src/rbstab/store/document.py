"""JSON files of plain data, written atomically, each with a digest of its data."""

import hashlib
import json
from pathlib import Path
from typing import Any

from rbstab.store.atomic import write_atomically
from rbstab.store.errors import NotAResultError, StoreError


def write_document(path: Path, data: dict[str, Any], *, replace: bool = True) -> None:
    """Write data to a JSON file.

    Args:
        path: The file. Missing folders are created.
        data: The data, of JSON's types; numbers are stored with all their digits.
        replace: Whether an existing file is replaced.

    Raises:
        ResultExistsError: The file exists and `replace` is not set.
        StoreError: The file cannot be written.
    """
    with_digest = {**data, "digest": _digest(data)}
    text = json.dumps(with_digest, indent=1, ensure_ascii=False, allow_nan=False)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, text.encode(), replace=replace)
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error.strerror or error}") from error


def read_document(path: Path) -> dict[str, Any]:
    """Read data from a JSON file.

    Raises:
        NotAResultError: The file is damaged.
        StoreError: The file cannot be read.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise StoreError(f"{path} cannot be read: {error.strerror or error}") from error
    try:
        data = json.loads(content)
        written = data.pop("digest")
        intact = bool(written == _digest(data))
    except (ValueError, KeyError, AttributeError, TypeError, RecursionError) as error:
        raise NotAResultError(f"{path} is damaged: {error}") from error
    if not intact:
        raise NotAResultError(f"{path} is damaged: its content does not match its digest")
    verified: dict[str, Any] = data
    return verified


def _digest(data: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()
