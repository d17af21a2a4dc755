"""The outcome of a motion: where the body rests, how far from where it should, and how surely."""

import math
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rbstab.analysis.certificate.verdict import Verdict
from rbstab.config.build import body_of
from rbstab.config.schema import NO_VARIANT, Config
from rbstab.experiment.answers.rounded import rounded_down
from rbstab.experiment.answers.wanted import angle_in_degrees, in_degrees, wanted
from rbstab.experiment.answers.words import Sureness
from rbstab.experiment.convergence.convergence import stored_convergence
from rbstab.experiment.convergence.zero_description import UNSTABLE
from rbstab.experiment.summary import is_driven, settling_time_of, stands_still
from rbstab.files.text import printable
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.quaternion import turned_back
from rbstab.store.result import Result

if TYPE_CHECKING:
    from rbstab.experiment.stored_proof.proof import Proof


class OutcomeKind(StrEnum):
    """What became of a motion."""

    RETURNS = "returns"
    """It is at rest at the desired attitude."""

    RESTS_ELSEWHERE = "rests_elsewhere"
    """It is at rest at another attitude."""

    UNSTABLE = "at_unstable_rest"
    """It is at rest where the stored energy falls in some direction: a small push moves it away."""

    MOVING = "moving"
    """It is still moving at the end of the run."""

    LEFT_RANGE = "left_range"
    """cos θ2 fell to `integration.range_bound`."""

    FAILED = "failed"
    """The run ended early for another reason."""

    @property
    def words(self) -> str:
        """The kind as people read it."""
        named = {"moving": "still moving", "left_range": "left the range"}
        named["at_unstable_rest"] = "at an unstable rest state"
        return named.get(self, self.replace("_", " "))


KINDS = tuple(OutcomeKind)
"""The kinds in the order of their codes."""

KIND_OF_STATUS: dict[str, OutcomeKind] = {
    **dict.fromkeys(RunStatus, OutcomeKind.FAILED),
    RunStatus.COMPLETED: OutcomeKind.MOVING,
    RunStatus.RANGE_LEFT: OutcomeKind.LEFT_RANGE,
}
"""The kind of a motion that is not at rest, by the status of its run. Others have failed."""


def outcome_codes(
    by_status: ArrayLike, at_rest: ArrayLike, tilts: ArrayLike, within: float, unstable: ArrayLike
) -> Array:
    """Return the codes of the outcomes of motions: indices in `KINDS`, shape () or (m,).

    Args:
        by_status: The codes of `KIND_OF_STATUS`.
        at_rest: Whether the completed run was at rest at its end.
        tilts: The tilt at rest, rad.
        within: The largest tilt of a body that rests where it should, rad.
        unstable: Whether the rest state is unstable.
    """
    rests = np.where(np.asarray(tilts) <= within, KINDS.index(OutcomeKind.RETURNS), 1)
    rests = np.where(unstable, KINDS.index(OutcomeKind.UNSTABLE), rests)
    moving = np.equal(by_status, KINDS.index(OutcomeKind.MOVING))
    return np.where(moving & at_rest, rests, by_status)


@dataclass(frozen=True)
class Outcome:
    """The outcome of the motion of a run.

    Args:
        kind: What became of it.
        sureness: How sure that is: proved of the exact motion, or seen of the computed one.
        time: When it came to rest, or when the run ended, s.
        orientation: Θ at which it rests, or at the end of the run, rad; None if it is no number.
        tilt: The tilt of this attitude, rad.
        rest_state: The number of the rest state that the motion converges to, from 1 for the
            lowest; None if it is not known.
        why: What is to be added: why a run failed, or what is proved beyond its end.
    """

    kind: OutcomeKind
    sureness: Sureness
    time: float
    orientation: tuple[float, ...] | None
    tilt: float | None
    rest_state: int | None
    why: str = ""

    @property
    def is_good(self) -> bool:
        """Whether the body rests where it should by itself, and not at an unstable rest state."""
        return self.kind is OutcomeKind.RETURNS and not self.why

    @property
    def brief(self) -> str:
        """The kind, and the tilt of a body that rests elsewhere."""
        if self.kind is not OutcomeKind.RESTS_ELSEWHERE or self.tilt is None:
            return self.kind.words
        return f"{self.kind.words}, {angle_in_degrees(self.tilt)} away"

    @property
    def sentence(self) -> str:
        """The outcome in words, without a full stop."""
        begin, where = self.kind.words, ""
        if self.kind in {OutcomeKind.MOVING, OutcomeKind.LEFT_RANGE, OutcomeKind.FAILED}:
            begin += f" at t = {self.time:.4g} s"
        if self.orientation is not None and self.tilt is not None:
            away = angle_in_degrees(self.tilt)
            where = f": at {in_degrees(self.orientation)}, {away} from the desired attitude"
        why = f" ({self.why})" if self.why else ""
        return f"{begin}{where}{why}: {self.sureness}"

    def as_data(self) -> dict[str, Any]:
        """Return the entries of its JSON."""
        return {name: value for name, value in asdict(self).items() if name != "why"}


def outcome_of(
    result: Result, config: Config | None = None, proof: "Proof | None" = None
) -> Outcome:
    """Return the outcome of a run.

    The kind is that of the computed run at its end. It is proved where the exact motion is proved
    to converge to the rest state at which the computed one is at rest.

    Args:
        result: The result.
        config: Its config, for the desired attitude; without one it is upright.
        proof: The proof of its rest states, if there is one.
    """
    status, settled = result.status, settling_time_of(result)
    completed, zero = status == RunStatus.COMPLETED, str(result.attributes.get("lyapunov_zero"))
    at_rest = completed and not math.isnan(settled)
    still = completed and not at_rest and stands_still(result)
    end = result["rest_orientation"] if at_rest else result["orientation"][-1]
    convergence, aim = stored_convergence(result.attributes), wanted(config)
    proved = None if convergence is None else convergence.proved
    number, state = convergence.rest_state if convergence is not None and proved else None, None
    if proof is not None:
        if number is None and at_rest:
            # Imported late: it reads proofs.
            from rbstab.experiment.stored_proof.starts import number_of

            number = number_of(proof, end)
        state = proof.states[number - 1] if number and number <= len(proof.states) else None
    if at_rest and proved and state is not None:
        end = np.array(state.orientation)
    if config is not None and config.integration.coordinates == "quaternion":
        end = turned_back(end)
    Theta = tuple(end.tolist()) if np.isfinite(end).all() else None
    away = None if Theta is None else aim.tilt(Theta)
    unstable = at_rest and bool(UNSTABLE in zero if state is None else state.index)
    by_status = KINDS.index(KIND_OF_STATUS.get(status, OutcomeKind.FAILED))
    tilt = math.nan if away is None else away
    code = outcome_codes(by_status, at_rest or still, tilt, aim.within, unstable)
    sureness, why = Sureness.SEEN, ""
    if result.attributes.get("verdict") == Verdict.VIOLATED:
        sureness = Sureness.NOT_DECIDED
    if (proved and at_rest) or (proved is False and not at_rest):
        sureness = Sureness.PROVED
    if status not in {RunStatus.COMPLETED, RunStatus.RANGE_LEFT}:
        why = printable(status)
    elif still and is_driven(result):
        why = "under its inputs"
    elif not at_rest and number is not None:  # only a proof knows it
        there = "its rest state" if state is None else in_degrees(state.orientation)
        why = f"the exact motion is proved to converge to {there}"
    return Outcome(
        kind=KINDS[int(code)],
        sureness=sureness,
        time=settled if at_rest else float(result["time"][-1]),
        orientation=Theta,
        tilt=away,
        rest_state=number,
        why=why,
    )


def pushes_of(config: Config | None, proof: "Proof | None") -> str:
    """Return which pushes are proved to return, as a sentence without a full stop; "" for none.

    A push gives kinetic energy to the body at rest at its desired rest state. The motion returns if
    this energy is below the proved depth of the valley. So it is for each angular velocity, about
    an axis through the contact point or the centre of gravity, below one that is printed.
    """
    aim = wanted(config)
    if proof is None or not proof.states:
        return ""
    depths = {region.rest_state: region.lower_bound for region in proof.regions}
    if proof.region is not None and proof.region.proved:
        depths[1] = max(depths.get(1, 0.0), proof.region.lower_bound)
    for number, state in enumerate(proof.states, start=1):
        depth = depths.get(number, 0.0)
        if depth > 0 and aim.holds(state.orientation):
            pose = in_degrees(state.orientation)
            spin = f" (or {_least_spin(config, depth)})" if config else ""
            return (
                f"pushes below {rounded_down(depth, 4)} J{spin}, from rest at {pose}, return there"
            )
    return ""


def _least_spin(config: Config, energy: float) -> str:
    """Return the least angular velocity with some kinetic energy, J, and about which axes."""
    body, variant = body_of(config), config.controller.variant
    free = variant in {"free", NO_VARIANT}
    inertia = body.inertia if free else body.inertia_about_contact
    largest = np.linalg.eigvalsh(inertia)[-1]
    through = "the centre of gravity" if free else "the contact point"
    # Axes that are farther away have more energy. A held contact point leaves none.
    axes = "any axis" if variant == "permanent" else f"any axis through {through}"
    return f"{rounded_down(math.sqrt(2 * energy / largest), 4)} rad/s about {axes}"
