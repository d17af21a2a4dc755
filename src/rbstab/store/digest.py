"""The digests of results, which show whether their files were changed."""

import hashlib
import json
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from rbstab.store.result import Result
from rbstab.store.variables import Variable

if TYPE_CHECKING:
    from rbstab.store.table import TableHeader


def digest_of(result: Result) -> str:
    """Return the SHA-256 of a whole result, in hexadecimal.

    It detects a number that was changed on disk, which HDF5 does not.
    """
    digest = hashlib.sha256(result.config.encode())
    digest.update(json.dumps(result.attributes, sort_keys=True).encode())
    _add_variables(digest, result.variables)
    return digest.hexdigest()


def digest_of_table(header: "TableHeader", arrays_digest: str) -> str:
    """Return the SHA-256 of a whole table, in hexadecimal.

    Args:
        header: The header of the table, without its digests.
        arrays_digest: The digest of its columns, from `TableDigest`.
    """
    first = {"arrays": arrays_digest, "first": header.first, "length": header.length}
    texts = (json.dumps(part, sort_keys=True) for part in (first, dict(header.attributes)))
    digest = hashlib.sha256("\n".join(texts).encode())
    _add_variables(digest, header.extras)
    return digest.hexdigest()


def _add_variables(digest: "hashlib._Hash", variables: Mapping[str, Variable]) -> None:
    for name in sorted(variables):
        variable = variables[name]
        dimensions, data, unit, long_name = variable
        kind = "text" if variable.is_text else data.dtype.newbyteorder("<").str
        digest.update(repr((name, dimensions, kind, data.shape, unit, long_name)).encode())
        if variable.is_text:
            digest.update(json.dumps(data.tolist()).encode())
        else:
            digest.update(np.ascontiguousarray(data, dtype=kind).tobytes())
