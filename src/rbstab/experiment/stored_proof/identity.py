"""The identities of proofs: digests of all that they depend on."""

import hashlib
import json
from functools import partial
from typing import Any

from rbstab.analysis.fingerprint import fingerprint
from rbstab.config.build import system_of
from rbstab.config.load import acting_sections
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import without_code

PROOF_VERSION = 6
"""To be increased when a change of the method changes its results; older proofs are made again."""


def proof_id(config: Config) -> str:
    """Return the identity of a proof: a digest of body, gravity, controller and equations.

    The equations are in it by their `fingerprint`: if they are changed, older proofs are not found.
    The code of users is not run for it: their text is part of the elements.
    """
    return digest_of([acting_sections(config), equations_of(config)])


def digest_of(parts: Any) -> str:
    """Return a digest of plain data, in 32 characters."""
    text = json.dumps(parts, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:32]


_FINGERPRINTS: dict[str, str] = {}
"""The fingerprints of the last configs, by the digest of what acts on their bodies."""

MOST_FINGERPRINTS = 1024
"""The largest number of them that is kept."""


def equations_of(config: Config) -> str:
    """Return the `fingerprint` of a config; it is computed once for all with equal bodies."""
    key = digest_of([acting_sections(config), config.integration.coordinates])
    if key not in _FINGERPRINTS:
        if len(_FINGERPRINTS) >= MOST_FINGERPRINTS:
            _FINGERPRINTS.clear()
        _FINGERPRINTS[key] = fingerprint(partial(system_of, without_code(config)))
    return _FINGERPRINTS[key]
