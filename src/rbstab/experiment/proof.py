"""What is proved of a body under its gravity and its controller, for every motion of it."""

import hashlib
import json
import time
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import BaseModel, ConfigDict

from rbstab.config.build import problem_of
from rbstab.config.load import resolved
from rbstab.config.schema import Config
from rbstab.experiment.switching_record import resting_system
from rbstab.mechanics.numbers import Array

if TYPE_CHECKING:
    from rbstab.analysis.proof.boxes import Boxes
    from rbstab.analysis.proof.certified_region import CertifiedRegion
    from rbstab.analysis.proof.rest_states import RestPoint, RestStates

PROOF_VERSION = 1
"""Raised whenever the way of proving changes what is found: older proofs are then made again."""

ROUND_OFF = 1e-9
"""Of v(0), which is not computed rigorously: sums of energies lose a thousandth of this."""

Triple = tuple[float, float, float]


class _Plain(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class ProvedState(_Plain):
    """One rest state: Θ, X and D; its potential energy, J; the number of directions downhill.

    enclosure is a box of Θ, low and high, in which there is exactly this one, where `proved`.
    """

    orientation: Triple
    position: Triple
    connector_state: tuple[float, ...]
    energy: float
    index: int
    proved: bool
    enclosure: tuple[Triple, Triple]


class ProvedRegion(_Plain):
    """{v < level} converges to the lowest rest state, by proof where v < lower_bound, J.

    energy, J, is c*, attained at the attitude `attained_at`: on the face of the range that is
    named, or at another rest state (face None).
    """

    energy: float
    level: float
    lower_bound: float
    attained_at: Triple
    face: str | None
    proved: bool


class Proof(_Plain):
    """The rest states of a config, lowest first, and the region that belongs to the lowest.

    outcome says how the search for them ended, in words, or why there is none; proved whether they
    are all; unique whether there is exactly one (None: not known); examined is the number of boxes;
    undecided are boxes of Θ that may hold more.
    """

    id: str
    outcome: str
    proved: bool
    unique: bool | None
    examined: int
    seconds: float
    undecided: tuple[tuple[Triple, Triple], ...]
    states: tuple[ProvedState, ...]
    region: ProvedRegion | None

    @property
    def globally_stable(self) -> bool | None:
        """Whether all that stays in the range comes to the one rest state; None: not known.

        By La Salle's theorem it does if there is one only, and that a minimum.
        """
        return self.unique and self.states[0].index == 0


def proof_id(config: Config) -> str:
    """The identity of a proof: of the body, the gravity and the controller, and nothing else."""
    data = resolved(config)
    parts = {name: data[name] for name in ("body", "gravity", "controller")}
    text = json.dumps([PROOF_VERSION, parts], sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def prove(config: Config, *, search_only: bool = False) -> Proof:
    """Looks for the rest states of a config, and proves that there are no others.

    Args:
        config: The config; its initial state and its integration are not looked at.
        search_only: Whether to leave out the proof.
    """
    # Imported late: a run reads proofs, and hardly ever makes one.
    from rbstab.analysis.proof.certified_region import certified_region
    from rbstab.analysis.proof.reduced_energy import NoReducedEnergy
    from rbstab.analysis.proof.rest_states import rest_states

    begin = time.perf_counter()
    identity = proof_id(config)
    try:
        with np.errstate(all="ignore"):
            found = rest_states(resting_system(problem_of(config)), proof=not search_only)
            region = certified_region(found)
    except NoReducedEnergy as error:
        seconds = time.perf_counter() - begin
        return _nothing(identity, str(error), seconds)
    return _proof(identity, found, region, time.perf_counter() - begin)


def start_level(config: Config, proof: Proof) -> float | None:
    """The energy with which a config starts above its lowest rest state, J: v(0) of the region.

    Returns:
        v(0), or None where there is no rest state to count from.
    """
    if not proof.states:
        return None
    problem = problem_of(config)
    with np.errstate(all="ignore"):
        energy = float(problem.system.observe(problem.start).energy.sum())
    return energy - proof.states[0].energy


def starts_inside(config: Config, proof: Proof) -> bool:
    """Whether a config starts where convergence to the lowest rest state is proved."""
    level = start_level(config, proof)
    if level is None or proof.region is None:
        return False
    return level + ROUND_OFF * abs(level) < proof.region.lower_bound


def _nothing(identity: str, why: str, seconds: float) -> Proof:
    return Proof(
        id=identity,
        outcome=why,
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
