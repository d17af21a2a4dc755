"""JSON files of plain data, written atomically, each with a digest of its data."""

import hashlib
import json
import math
from pathlib import Path
from typing import Any, NoReturn, TypeVar

from pydantic import BaseModel, ValidationError

from rbstab.files.text import printable, shortened
from rbstab.store.disk.atomic import write_atomically
from rbstab.store.disk.paths import read_regular, store_errors
from rbstab.store.errors import NotAResultError, StoreError

MAX_BYTES = 16 << 20
"""The largest size of a file."""

MAX_VALUES = 2_000_000
"""The most values in a file. Each one takes some 100 bytes of memory, even if it is empty."""

Model = TypeVar("Model", bound=BaseModel)


def write_document(path: Path, data: dict[str, Any], *, replace: bool = True) -> None:
    """Write data to a JSON file.

    Args:
        path: The file. Missing folders are created.
        data: The data, of JSON's types; numbers are stored with all their digits.
        replace: Whether an existing file is replaced.

    Raises:
        ResultExistsError: The file exists and `replace` is not set.
        StoreError: The file cannot be written, or the data are too large.
    """
    with_digest = {**data, "digest": digest_of(data)}
    short = (",", ":")
    text = json.dumps(with_digest, separators=short, ensure_ascii=False, allow_nan=False)
    content = text.encode()
    if _is_too_large(content):
        raise StoreError(f"{path} cannot be written: it would be too large to be read again")
    with store_errors(path, "written"):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, content, replace=replace)


def read_document(path: Path) -> dict[str, Any]:
    """Read data from a JSON file. Their types and values are not checked; see `read_model`.

    Raises:
        NotAResultError: The file is damaged.
        StoreError: The file cannot be read.
    """
    content = read_regular(path, MAX_BYTES)
    if _is_too_large(content):
        raise NotAResultError(f"{path} is damaged: it has too many values")
    try:
        data = json.loads(content.decode(), parse_constant=_refuse, parse_float=_finite)
        written = data.pop("digest", None)
        intact = bool(written == digest_of(data))
    except (ValueError, AttributeError, TypeError, RecursionError) as error:
        raise NotAResultError(f"{path} is damaged: {error}") from error
    if not intact:
        raise NotAResultError(f"{path} is damaged: its content does not match its digest")
    verified: dict[str, Any] = data
    return verified


def checked(path: Path, data: dict[str, Any], model: type[Model]) -> Model:
    """Return data of a JSON file as a model, whose types and limits they must fit exactly.

    Args:
        path: The file, for messages.
        data: The data, from `read_document`.
        model: The model.

    Raises:
        NotAResultError: The data do not fit.
    """
    try:
        # As JSON: pydantic's strict mode takes JSON's lists for tuples, but not Python's.
        return model.model_validate_json(json.dumps(data), strict=True)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False, include_context=False)[0]
        key = printable(shortened(".".join(map(str, first["loc"]))))  # it may be any text
        reason = f"{key}: {first['msg']}" if key else str(first["msg"])
        raise NotAResultError(f"{path} is damaged: {reason}") from error


def read_model(path: Path, model: type[Model]) -> Model:
    """Read a JSON file as a model; as `read_document`, then `checked`.

    Raises:
        NotAResultError: The file is damaged, or its data do not fit.
        StoreError: The file cannot be read.
    """
    return checked(path, read_document(path), model)


def _is_too_large(content: bytes) -> bool:
    values = content.count(b",") + content.count(b"[") + content.count(b"{")
    return len(content) > MAX_BYTES or values > MAX_VALUES


def _refuse(constant: str) -> NoReturn:
    raise ValueError(f"{constant} is not a number of JSON")


def _finite(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text[:20]} is too large")
    return number


def digest_of(data: dict[str, Any]) -> str:
    """Return the SHA-256 of plain data, in hexadecimal."""
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()
