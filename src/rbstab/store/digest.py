"""The digest of a result, which shows whether its file was changed."""

import hashlib
import json

import numpy as np

from rbstab.store.result import Result


def digest_of(result: Result) -> str:
    """Return the SHA-256 of a whole result, in hexadecimal.

    It detects a number that was changed on disk, which HDF5 does not.
    """
    digest = hashlib.sha256(result.config.encode())
    digest.update(json.dumps(result.attributes, sort_keys=True).encode())
    for name in sorted(result.variables):
        dimensions, data, unit, long_name = result.variables[name]
        is_text = data.dtype.kind in "OUT"
        kind = "text" if is_text else data.dtype.newbyteorder("<").str
        digest.update(repr((name, dimensions, kind, data.shape, unit, long_name)).encode())
        if is_text:
            digest.update(json.dumps(data.tolist()).encode())
        else:
            digest.update(np.ascontiguousarray(data, dtype=kind).tobytes())
    return digest.hexdigest()
