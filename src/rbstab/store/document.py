"""Plain data in a file of JSON that is whole or not there, with a digest of what it says."""

import hashlib
import json
from pathlib import Path
from typing import Any

from rbstab.store.atomic import write_atomically
from rbstab.store.errors import NotAResultError, StoreError


def write_document(path: Path, data: dict[str, Any], *, replace: bool = True) -> None:
    """Writes data, in place of what stood there.

    Args:
        path: The file. Missing folders are made.
        data: What JSON can hold; numbers come back to the last digit.
        replace: Whether a file of that name gives way.

    Raises:
        ResultExistsError: The file exists and `replace` is not set.
        StoreError: The operating system refused.
    """
    whole = {**data, "digest": _digest(data)}
    text = json.dumps(whole, indent=1, ensure_ascii=False, allow_nan=False)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, text.encode(), replace=replace)
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error.strerror or error}") from error


def read_document(path: Path) -> dict[str, Any]:
    """Reads data.

    Raises:
        NotAResultError: It is not what was written.
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
        raise NotAResultError(f"{path} is damaged: it is not what was written (by its digest)")
    found: dict[str, Any] = data
    return found


def _digest(data: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()
