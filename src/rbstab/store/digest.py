"""The digest by which a result is known to be what was written."""

import hashlib
import json

import numpy as np

from rbstab.store.result import Result


def digest_of(result: Result) -> str:
    """SHA-256, in hexadecimal, of everything that a result holds.

    HDF5 does not notice a number that has changed on the disk; this does.
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
