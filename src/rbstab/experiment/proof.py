"""Proofs for a body under its gravity and its controller, valid for all its motions."""

import hashlib
import json
import time
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, NonNegativeInt, model_validator

from rbstab.analysis.approached_state import SAME_STATE
from rbstab.analysis.rest_state import RestState
from rbstab.config.build import problem_of
from rbstab.config.load import resolved
from rbstab.config.schema import Config
from rbstab.experiment.switching_record import smooth_rest_system
from rbstab.integrate.problem import Problem
from rbstab.mechanics.numbers import Array

if TYPE_CHECKING:
    from rbstab.analysis.proof.boxes import Boxes
    from rbstab.analysis.proof.certified_region import CertifiedRegion
    from rbstab.analysis.proof.rest_states import RestPoint, RestStates

PROOF_VERSION = 1
"""To be increased when a change of the method changes its results; older proofs are then redone."""

ROUND_OFF = 1e-9
"""Relative error allowed for v(0), which is not computed rigorously."""

SUM_ERROR = 1e-13
"""Error allowed for v(0), relative to the sum of the absolute energies that it is computed from.

They can be much larger than v(0), if the body starts near its rest state under a load.
"""

Triple = tuple[float, float, float]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class ProvedState(_Model):
    """One rest state: Θ, X and D, and its potential energy, J.

    index is the number of independent directions in which the energy decreases.

    enclosure is a box of Θ, from low to high. If `proved`, it contains exactly this rest state.
    """

    orientation: Triple
    position: Triple
    connector_state: tuple[float, ...]
    energy: float
    index: NonNegativeInt
    proved: bool
    enclosure: tuple[Triple, Triple]


class ProvedRegion(_Model):
    """Motions with v < level converge to the lowest rest state; proved for v < lower_bound, J.

    energy is c*, J. It is attained at the orientation `attained_at`: on the named face of the
    range, or at another rest state (face None).
    """

    energy: float
    level: float
    lower_bound: float
    attained_at: Triple
    face: str | None
    proved: bool


class Proof(_Model):
    """The rest states of a config, lowest first, and the certified region of the lowest.

    outcome describes how the search ended, or gives the reason why there is no proof. proved is
    True if `states` are proved to be all rest states. unique is True if there is exactly one (None:
    not known). examined is the number of boxes that the search examined. undecided are boxes of Θ
    that may contain more rest states.
    """

    id: str
    outcome: str
    proved: bool
    unique: bool | None
    examined: NonNegativeInt
    seconds: float
    undecided: tuple[tuple[Triple, Triple], ...]
    states: tuple[ProvedState, ...]
    region: ProvedRegion | None

    @model_validator(mode="after")
    def _check_states(self) -> Self:
        count = len(self.states)
        if (self.unique is not None and self.unique != (count == 1)) or (self.region and not count):
            raise ValueError("the number of states does not fit the other entries")
        return self

    @property
    def globally_stable(self) -> bool | None:
        """Whether every motion that stays in the range converges to the only rest state.

        By La Salle's theorem this is true if that state is a minimum, for motions that keep a
        distance from θ2 = ±π/2: the theorem needs a closed set in which the equations are smooth.
        None: not known.
        """
        return self.unique and self.states[0].index == 0


def proof_id(config: Config) -> str:
    """Return the identity of a proof: a digest of body, gravity and controller."""
    data = resolved(config)
    parts = {name: data[name] for name in ("body", "gravity", "controller")}
    text = json.dumps([PROOF_VERSION, parts], sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def prove(config: Config, problem: Problem | None = None, *, search_only: bool = False) -> Proof:
    """Search for the rest states of a config, and prove that there are no others.

    Args:
        config: The config; its initial state and its integration have no effect.
        problem: The problem of the config, if it is built already.
        search_only: Whether to skip the proof.
    """
    # Imported late: a run usually reads a stored proof and makes none.
    from rbstab.analysis.proof.certified_region import certified_region
    from rbstab.analysis.proof.reduced_energy import NoReducedEnergy
    from rbstab.analysis.proof.rest_states import rest_states

    start_time = time.perf_counter()
    identity = proof_id(config)
    try:
        with np.errstate(all="ignore"):
            system = smooth_rest_system(problem or problem_of(config))
            found = rest_states(system, proof=not search_only)
            region = certified_region(found)
    except NoReducedEnergy as error:
        seconds = time.perf_counter() - start_time
        return _no_proof(identity, str(error), seconds)
    return _proof(identity, found, region, time.perf_counter() - start_time)


def start_level(problem: Problem, proof: Proof) -> float | None:
    """Return v(0) of a problem, J: the energy at the start minus that of the lowest rest state.

    Returns:
        v(0); None if no rest state is known.
    """
    if not proof.states:
        return None
    return float(_start_energies(problem).sum()) - proof.states[0].energy


def number_of(proof: Proof, rest: RestState) -> int | None:
    """Return the number of a rest state among those of a proof, from 1 for the lowest.

    None if it is not one of them, or if they are not proved to be all.
    """
    if not proof.proved:
        return None
    for number, state in enumerate(proof.states, start=1):
        if np.abs(rest.motion.Theta - state.orientation).max() < SAME_STATE:
            return number
    return None


def starts_inside(problem: Problem, proof: Proof) -> bool:
    """Return whether a problem starts where convergence to the lowest rest state is proved."""
    level = start_level(problem, proof)
    if level is None or proof.region is None:
        return False
    terms = float(np.abs(_start_energies(problem)).sum()) + abs(proof.states[0].energy)
    error = ROUND_OFF * abs(level) + SUM_ERROR * terms
    return level + error < proof.region.lower_bound


def _start_energies(problem: Problem) -> Array:
    """Return the energy at the start by part, shape (parts,), J."""
    with np.errstate(all="ignore"):
        return problem.system.observe(problem.start).energy


def _no_proof(identity: str, reason: str, seconds: float) -> Proof:
    return Proof(
        id=identity,
        outcome=reason,
        proved=False,
        unique=None,
        examined=0,
        seconds=seconds,
        undecided=(),
        states=(),
        region=None,
    )


def _proof(
    identity: str, found: "RestStates", region: "CertifiedRegion | None", seconds: float
) -> Proof:
    from rbstab.analysis.proof.boxes import hulls

    undecided = hulls(found.undecided)
    ends = zip(undecided.low.tolist(), undecided.high.tolist(), strict=True)
    return Proof(
        id=identity,
        outcome=found.outcome.value,
        proved=found.proved,
        unique=found.unique,
        examined=found.examined,
        seconds=seconds,
        undecided=tuple((_triple(low), _triple(high)) for low, high in ends),
        states=tuple(_state(point) for point in found.states),
        region=None if region is None else _region(region),
    )


def _state(point: "RestPoint") -> ProvedState:
    rest, box = point.state, point.enclosure
    return ProvedState(
        orientation=_triple(rest.motion.Theta),
        position=_triple(rest.motion.X),
        connector_state=tuple(map(float, rest.own)),
        energy=rest.energy,
        index=point.index,
        proved=point.proved,
        enclosure=_corners(box),
    )


def _region(region: "CertifiedRegion") -> ProvedRegion:
    return ProvedRegion(
        energy=region.energy,
        level=region.level,
        lower_bound=region.lower_bound,
        attained_at=_triple(region.attained_at),
        face=None if region.face is None else _face_name(region.face.value),
        proved=region.proved,
    )


def _face_name(face: Any) -> str:
    axis, sign = face
    end = "π/2" if axis == 1 else "π"
    return f"θ{axis + 1} = {'-' if sign < 0 else ''}{end}"


def _corners(box: "Boxes") -> tuple[Triple, Triple]:
    return _triple(box.low[0]), _triple(box.high[0])


def _triple(values: Array | list[float]) -> Triple:
    a, b, c = (float(value) for value in values)
    return a, b, c


def reached_state(proof: Proof, energy: float, low: Array, high: Array) -> int | None:
    """Return the rest state to which every motion converges that has an energy and a Θ in a box.

    TEMPORARY: replaced by the regions of all minima.
    """
    if proof.region is None or not proof.states:
        return None
    inside = energy < proof.states[0].energy + proof.region.lower_bound - 1e-9
    return 1 if inside and np.all(np.abs([low, high]) < [np.pi, np.pi / 2, np.pi]) else None
