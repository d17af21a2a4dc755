"""The identity of a proof: a digest of all that it depends on."""

import hashlib
import json
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from rbstab.analysis.fingerprint import fingerprint
from rbstab.config.build import system_of
from rbstab.config.load import acting_sections
from rbstab.config.schema import NO_VARIANT, Config
from rbstab.config.user_code.permission import has_code, without_code

PROOF_VERSION = 3
"""To be increased when a change of the method changes its results; older proofs are then redone.

Version 1 took the doubles of a config as exact, and had no index and no regions that are proved for
each minimum. Ids of versions 1 and 2 have no fingerprint of the equations.
"""

FINGERPRINT_VERSION = 3
"""The first version whose ids have a fingerprint of the equations."""

BARRIER_VERSION = 1
"""The version of the method for configs with a barrier; without one it is in no id."""

SWITCHING_GUARD_VERSION = 1
"""The same for configs with a soft guard or a stop: before it, nothing was proved of them."""

OUTER_BARRIER_VERSION = 1
"""The same for configs with a barrier on θ1 and θ3: before it, nothing was proved of them."""

SPRING_VERSION = 1
"""The same for configs with a spring: before it, nothing was proved of them."""

TIED_VERSION = 1
"""The same for those of them whose body is tied."""

TIED_BARRIER_VERSION = 1
"""The same for those of them with a guard: before it, nothing was proved of a barrier there."""

TIED_LIGAMENT_VERSION = 1
"""The same for those of them with a ligament: before it, nothing was proved of both together."""

TIED_GUARD_VERSION = 1
"""The same for those of them with another guard than a barrier on θ2: before it, nothing was proved
of them."""

NO_REST_LENGTH_VERSION = 1
"""The same for those of them with a spring without a rest length: before it, more was proved of a
damped one than holds where it has no length."""

LIGAMENT_VERSION = 1
"""The same for configs with a ligament: before it, nothing was proved of them."""

DAMPED_VERSION = 2
"""The same for configs without a controller whose elements may damp every motion: before 1, nothing
was proved of them, and before 2, nothing where only ties damp them, and zeros at θ2 = ±π/2 and
families were counted as rest states."""

ROTATIONS_VERSION = 1
"""The same for configs whose energy may depend on no Euler angles: before it, zeros of ∂U/∂Θ at
θ2 = ±π/2 hid their rest states."""

USER_CODE_VERSION = 7
"""The same for configs with elements of users: before 1, nothing was proved of them, and before 2,
nothing if they switch or have own states, if the body is not held, or if nothing else damps it.
Before 3, nothing was proved of a body that is not held with one whose energy is no quadratic
function of X. Before 4, nothing was proved of one whose force jumps, before 5, of one whose energy
is not quadratic in own states, before 6, of one with own states that switches, and before 7, of one
whose force jumps and pushes away.
"""

SWITCHING_GUARDS = ("stiff", "repelling", "stop")

DAMPING_KINDS = ("attitude", "visco-elastic", "embedded")

HELD_OR_SLIDING = ("permanent", "sliding")
"""Variants whose proofs do not depend on `TIED_VERSION`; with a sliding connector there is none."""


def proof_id(config: Config, version: int = PROOF_VERSION) -> str:
    """Return the identity of a proof: a digest of body, gravity, controller and version.

    From version 3 on it depends on the equations too, by their `fingerprint`: if the equations are
    changed, older proofs are not found. With some elements it has further versions. The code of
    users is not run for it: their text is part of the elements.
    """
    parts: list[Any] = [version, acting_sections(config)]
    if version >= FINGERPRINT_VERSION:
        parts.append(_equations_of(config))
    if any(element.kind == "guard" for element in config.elements.values()):
        parts.append(f"barrier {BARRIER_VERSION}")
    if any(getattr(one, "method", None) in SWITCHING_GUARDS for one in config.elements.values()):
        parts.append(f"switching guard {SWITCHING_GUARD_VERSION}")
    if any(getattr(element, "outer_stiffness", 0) for element in config.elements.values()):
        parts.append(f"outer barrier {OUTER_BARRIER_VERSION}")
    if any(element.kind == "spring" for element in config.elements.values()):
        parts.append(f"spring {SPRING_VERSION}")
        if config.controller.variant not in HELD_OR_SLIDING:
            parts += _versions_of_tied(config)
    if any(element.kind == "ligament" for element in config.elements.values()):
        parts.append(f"ligament {LIGAMENT_VERSION}")
    if has_code(config):
        parts.append(f"user code {USER_CODE_VERSION}")
    damped = any(element.kind in DAMPING_KINDS for element in config.elements.values())
    if damped and config.controller.variant == NO_VARIANT:
        parts.append(f"damped by elements {DAMPED_VERSION}")
    if _may_need_no_angles(config):
        parts.append(f"rotations {ROTATIONS_VERSION}")
    text = json.dumps(parts, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def _may_need_no_angles(config: Config) -> bool:
    """Return whether nothing in a config is known to depend on Euler angles."""
    stiffness = np.asarray(getattr(config.controller, "K_r", 0.0))
    angles = any(element.kind == "guard" for element in config.elements.values())
    return not (angles or has_code(config) or np.any(stiffness != 0.0))


def _versions_of_tied(config: Config) -> Iterator[str]:
    """Yield what belongs to the id of a body with springs that is tied."""
    elements = config.elements.values()
    kinds = {element.kind for element in elements}
    yield f"tied {TIED_VERSION}"
    if "guard" in kinds:
        yield f"tied barrier {TIED_BARRIER_VERSION}"
    if _has_other_guards(config):
        yield f"tied guard {TIED_GUARD_VERSION}"
    if "ligament" in kinds:
        yield f"tied ligament {TIED_LIGAMENT_VERSION}"
    if any(getattr(one, "rest_length", None) == 0 for one in elements):
        yield f"no rest length {NO_REST_LENGTH_VERSION}"


def _has_other_guards(config: Config) -> bool:
    """Return whether there is another guard than a barrier on θ2."""
    elements = config.elements.values()
    soft = any(getattr(one, "method", None) in SWITCHING_GUARDS for one in elements)
    return soft or any(getattr(one, "outer_stiffness", 0) for one in elements)


_KNOWN_EQUATIONS: dict[str, str] = {}
"""The fingerprints of the last configs, by the text of what acts on their bodies."""

MOST_KNOWN = 1024
"""The largest number of them that is kept."""


def _equations_of(config: Config) -> str:
    """Return the `fingerprint` of a config; it is computed once for all with equal bodies."""
    key = json.dumps([acting_sections(config), config.integration.coordinates], sort_keys=True)
    if key not in _KNOWN_EQUATIONS:
        if len(_KNOWN_EQUATIONS) >= MOST_KNOWN:
            _KNOWN_EQUATIONS.clear()
        _KNOWN_EQUATIONS[key] = fingerprint(partial(system_of, without_code(config)))
    return _KNOWN_EQUATIONS[key]
