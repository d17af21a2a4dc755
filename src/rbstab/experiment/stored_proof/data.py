"""The data of a proof: the models of its rest states and regions."""

from typing import Any, Literal, Self

from pydantic import NonNegativeInt, model_validator

from rbstab.config.schema import Config
from rbstab.experiment.convergence.convergence import ASK_FOR_PROOF
from rbstab.experiment.stored_proof.entries import OnRotations, ProvedEnergy, ProvedFamily
from rbstab.experiment.stored_proof.identity import PROOF_VERSION
from rbstab.files.text import grouped, line
from rbstab.mechanics.states import PITCH
from rbstab.proof.entries import Entry, ProvedMinimum, ProvedRegion, ProvedState, Triple

BARRIER, STOP = "a barrier", "a stop"
"""What keeps every motion away from θ2 = ±π/2 (`Proof.kept_by`)."""

STOPPED = "the limit on the number of boxes was reached"
"""The outcome of a search that stopped at its limit (`SearchOutcome.BOX_LIMIT`)."""

TOO_FEW = "more boxes are not expected to help"
"""The begin of the outcome of such a search that would need far more boxes than any proof tries."""

CONFIG = "config"
"""The name under which a proof keeps the config of which it was asked."""

GOES_ON = f"{ASK_FOR_PROOF} tries more"
"""What is said of a proof that ended early, where more boxes may prove more."""


UNSPRUNG = "K_r is not positive definite"
"""The reason why rest states may form a family, and be farther away than any angle."""


class ProvedStates(Entry):
    """The rest states in a range of Θ, lowest first, and the regions of the minima.

    outcome describes how the search ended, or gives the reason why there is no proof. proved is
    True if `states` are proved to be all rest states. unique is True if there is exactly one (None:
    not known). examined is the number of boxes that the search examined. undecided are boxes of Θ
    that may contain more rest states.

    region holds in all of the range. regions has a region of each minimum that has one, in the
    order of the states.

    end is the largest |Θ| of the box that was searched, rad: that of the range, but it ends at a
    stop. None: nothing was searched.
    """

    outcome: str
    proved: bool
    unique: bool | None
    examined: NonNegativeInt
    undecided: tuple[tuple[Triple, Triple], ...]
    states: tuple[ProvedState, ...]
    region: ProvedRegion | None
    regions: tuple[ProvedMinimum, ...] = ()
    end: Triple | None = None

    @model_validator(mode="after")
    def _check_states(self) -> Self:
        """Refuse what the checker does not see: it reads the states, not what follows from them."""
        count = len(self.states)
        if (self.unique is not None and self.unique != (count == 1)) or (self.region and not count):
            raise ValueError("the number of states does not fit the other entries")
        if any(max(region.rest_state, region.pass_state or 1) > count for region in self.regions):
            raise ValueError("a region belongs to a state that is not listed")
        return self

    @property
    def stable_count(self) -> int:
        """The number of stable rest states: the minima of the energy."""
        return sum(state.stable is True for state in self.states)

    @property
    def globally_stable(self) -> bool | None:
        """Whether every motion that stays in the range converges to the only rest state.

        By La Salle's theorem this is true if that state is a minimum, for motions that keep a
        distance from θ2 = ±π/2: the theorem needs a closed set in which the equations are smooth.
        With a barrier all motions keep it. None: not known.
        """
        if self.unique and self.states[0].index_proved is False:
            return None
        return self.unique and self.states[0].index == 0

    def claims(self, end: list[Any], *, every_start: bool | None) -> dict[str, Any]:
        """Return what is claimed about a range |Θ| <= end, as the checker reads it."""
        level = None if self.region is None else self.region.energy_bound
        claimed: dict[str, Any] = {
            "end": end,
            "complete": self.proved,
            "states": [
                {
                    "enclosure": [list(corner) for corner in state.enclosure],
                    "index": state.index if state.index_proved else None,
                    "held": bool(state.held),
                    "ridge": bool(state.ridge),
                }
                for state in self.states
                if state.proved
            ],
            "every_start": bool(every_start),
            # Below `level`, all of the range is the region of the lowest.
            "regions": [
                [region.rest_state - 1, region.energy_bound]
                for region in self.regions
                if level is None or region.energy_bound > level
            ],
        }
        if self.undecided:
            claimed["undecided"] = [[list(low), list(high)] for low, high in self.undecided]
        return claimed if level is None else claimed | {"level": level}


class UnwrappedStates(ProvedStates):
    """The rest states with |θ2| < π/2 and any real θ1 and θ3, and the regions of the minima.

    All of them have |Θ| < end, rad; regions end there too. They are not in `Proof.states` if they
    are beyond the range of eq. 5. A motion leaves this range only through θ2 = ±π/2.

    every_start is true if a barrier or a stop keeps every motion away from θ2 = ±π/2 and there is
    one rest state, a minimum: then c* is infinite, and every motion that starts with |θ2| < π/2 (up
    to the stop) converges to it. There is no region then, as none is needed. None: not proved.
    """

    every_start: Literal[True] | None = None


class ProofData(ProvedStates):
    """The data of a proof, and what follows from them alone; see `Proof`."""

    id: str
    version: int = PROOF_VERSION
    seconds: float = 0.0
    reduced_energy: ProvedEnergy | None = None
    unwrapped: UnwrappedStates | None = None
    brief: Literal[True] | None = None
    closed: Literal[True] | None = None
    on_rotations: OnRotations | None = None

    @model_validator(mode="after")
    def _check_version(self) -> Self:
        if self.version != PROOF_VERSION:
            raise ValueError("the proof is of an older program")
        return self

    def of(self, config: Config) -> Self:
        """Return this proof for one of the configs that it is about.

        They differ in their starts, for example, and in the pose that is desired.
        """
        proof = self.model_copy()
        # It is no field: it is not in files, and makes no difference between proofs.
        vars(proof)[CONFIG] = config
        return proof

    @property
    def config(self) -> Config | None:
        """The config of which it was asked; None if it was not (see `of`)."""
        config: Config | None = vars(self).get(CONFIG)
        return config

    def __repr__(self) -> str:
        """Return one line: the rest states, and how the proof ended."""
        count = len(self.states)
        states = f"{count} rest state{'' if count == 1 else 's'}"
        ended = "proved to be all" if self.proved else self.ended
        return line("Proof", "", [states, ended, f"{self.examined} boxes"])

    __str__ = __repr__

    @property
    def claims_nothing(self) -> bool:
        """Whether it only says why there is no proof, and which rest states a search found."""
        nothing = not self.proved and not any(state.proved for state in self.states)
        return nothing and not self.has_energy and self.region is None

    @property
    def has_energy(self) -> bool:
        """Whether it has the energy from which it follows."""
        return self.reduced_energy is not None or self.on_rotations is not None

    @property
    def globally_stable(self) -> bool | None:
        """The same as in `ProvedStates`; it is false beside a family of rest states."""
        return False if self.families else super().globally_stable

    @property
    def families(self) -> tuple[ProvedFamily, ...]:
        """The families of rest states, where all of these are known."""
        return () if self.on_rotations is None else self.on_rotations.families

    @property
    def place(self) -> str:
        """Where it looks for rest states, as the end of a phrase."""
        return "in the range" if self.on_rotations is None else "on SO(3)"

    @property
    def needs_lengths(self) -> bool:
        """Whether it is about motions on which each spring keeps a length: theorem 12."""
        return self.reduced_energy is not None and self.reduced_energy.has_springs

    @property
    def goes_on(self) -> bool:
        """Whether `rbstab run --prove` may prove more, as it takes more boxes."""
        return self.brief is True and not (self.outcome.startswith(TOO_FEW) or self.unsprung)

    @property
    def ended(self) -> str:
        """How the search ended; with the command that goes on, if more boxes may prove more."""
        return self.ended_in(self)

    def ended_in(self, states: ProvedStates) -> str:
        """Return the same of the search in one of both ranges."""
        if states.outcome != STOPPED:
            return states.outcome
        then = f"; {GOES_ON}" if self.brief else ", the most that are tried"
        if self.unsprung:
            then = f"; {UNSPRUNG}, so rest states may form a family, for which none suffice"
        return f"the proof needs more than {grouped(states.examined)} boxes{then}"

    @property
    def unsprung(self) -> bool:
        """Whether the quadratic part of the energy, that of K_r, is not positive definite."""
        if self.reduced_energy is None:
            return False
        from rbstab.proof.exact.expr import variable
        from rbstab.proof.exact.matrices import inverse_of_definite
        from rbstab.proof.exact.rewriting import quadratic_in
        from rbstab.proof.model import THETA  # imported late: few proofs end so

        U, angles = self.reduced_energy.energy.U, set().union(*(variable(k).atoms for k in THETA))
        turns = angles - variable(PITCH).atoms  # guards have steps of θ2 alone
        where = {"sqrt": angles, "step": turns}
        if any(a.inner.atoms & where[a.kind] for a in U.all_atoms if a.kind in where):
            return False  # N has a limit: its energy is not quadratic
        return inverse_of_definite(quadratic_in(U, THETA).H) is None

    @property
    def kept_by(self) -> str | None:
        """What keeps every motion away from θ2 = ±π/2: "a barrier" or "a stop"; None: nothing."""
        if self.reduced_energy is not None and self.reduced_energy.stop is not None:
            return STOP
        return BARRIER if PITCH in self._closed_angles else None

    @property
    def every_start(self) -> bool:
        """Whether every motion from the range (up to a stop) converges to the one rest state."""
        wide = self.unwrapped and self.unwrapped.every_start
        return self.kept_by is not None and bool(self.closed if self.within_barriers else wide)

    @property
    def confined(self) -> bool:
        """Whether every start keeps to a set in which `states` are proved to be all rest states.

        This set is |θ2| < π/2 with all real θ1 and θ3, or the range itself with barriers on these.
        """
        wide = self.unwrapped
        same = wide is not None and wide.proved and len(wide.states) == len(self.states)
        complete = self.proved and not self.needs_lengths and (self.within_barriers or same)
        return self.kept_by is not None and complete

    @property
    def within_barriers(self) -> bool:
        """Whether barriers on θ1 and θ3 keep these angles between -π and π."""
        return 0 in self._closed_angles

    @property
    def _closed_angles(self) -> tuple[int, ...]:
        """The angles, 0 to 2, of which a barrier or a stop lets no motion reach the end."""
        return () if self.reduced_energy is None else self.reduced_energy.closed


SUPPLIES = "an element supplies power"
"""Why nothing is proved of a config with inputs."""
