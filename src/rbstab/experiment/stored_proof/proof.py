"""A proof: its data, and what other modules conclude from them."""

from typing import TYPE_CHECKING

from rbstab.experiment.stored_proof.data import ProofData

if TYPE_CHECKING:
    from rbstab.experiment.stored_proof.almost_every_start import AlmostEveryStart
    from rbstab.proof.record import Record


class Proof(ProofData):
    """The rest states of a config and the starts that converge to them, made by `prove`.

    The range of eq. 5 is |θ2| < π/2, |θ1| and |θ3| < π.

    Attributes:
        outcome: How the search ended, or the reason why there is no proof.
        proved: Whether `states` are proved to be all rest states in the range.
        unique: Whether there is exactly one rest state in the range; None: not known.
        globally_stable: Whether every motion that stays in the range, away from θ2 = ±π/2,
            converges to the only rest state; None: not known.
        states: The rest states, lowest energy first: orientation Θ, rad; position X, m; energy, J;
            index (0: a minimum); enclosure, a box of Θ that is proved to contain exactly this one.
        stable_count: The number of stable ones.
        region: The certified region. If `region.proved`, every motion with v < `region.lower_bound`
            converges to the lowest rest state; v is the energy above it, J. None: no region.
        regions: A region of each minimum that has one: `rest_state` is its number from 1, and
            `lower_bound` the proved depth of its valley, J.
        undecided: Boxes of Θ, rad, which may contain more rest states.
        examined: The number of boxes that the search examined.
        unwrapped: The same for all real θ1 and θ3. None after a search without a proof, and where
            θ1 and θ3 have no bound that is small enough for a proof.
        reduced_energy: U, the stored energy at given angles, J, least over the position of a body
            that is not held. With springs of such a body, rest states are those at which no spring
            has length zero.
        closed: True if barriers keep every motion in the range of eq. 5 that starts there, and
            there is one rest state, a minimum: then every such motion converges to it. There is no
            region then, as none is needed. None: not proved.
        brief: True if nobody asked for the proof, and a search stopped at its smaller limit of
            boxes: `rbstab run --prove` may prove more. None otherwise.
        on_rotations: Of a body whose energy depends on no Euler angles: that `states` are those
            among all rotations, with their quaternions. None for other bodies.
        id: A checksum of the body, its gravity, what acts on it, and the equations.
        version: That of the method.
        seconds: The time that the proof took, s.
    """

    @property
    def almost_every_start(self) -> "AlmostEveryStart":
        """Whether almost every start converges to a stable rest state (theorem 14).

        A record with `proved`, `returns`, `states` and `why`.
        """
        # Imported late: its hypotheses need the elements and the bounds of proofs.
        from rbstab.experiment.stored_proof.almost_every_start import almost_every_start

        return almost_every_start(self)

    @property
    def record(self) -> "Record":
        """What the checker reads: the energy, and the claims about each range (`proof.record`).

        The proof has a reduced energy.
        """
        from rbstab.proof.record import FORMAT  # imported late: only `rbstab verify` needs it

        assert self.reduced_energy is not None
        pitch, wide = self.reduced_energy.stop or "pi/2", self.unwrapped
        ranges = [self.claims(["pi", pitch, "pi"], every_start=self.closed)]
        if wide is not None and wide.end is not None:
            end = [wide.end[0], pitch, wide.end[2]]
            ranges.append(wide.claims(end, every_start=wide.every_start) | {"everywhere": True})
        energy = self.reduced_energy.model_dump(mode="json")
        return {"format": FORMAT, "energy": energy, "ranges": ranges}


def no_proof(identity: str, reason: str) -> Proof:
    """Return the record of a config that has no proof, with the reason."""
    return Proof(
        id=identity,
        outcome=reason,
        proved=False,
        unique=None,
        examined=0,
        undecided=(),
        states=(),
        region=None,
    )
