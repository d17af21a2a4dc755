"""The entries of a stored proof that few proofs have, and its energy."""

from functools import cached_property
from typing import TYPE_CHECKING

from pydantic import NonNegativeInt, PositiveInt

from rbstab.proof.entries import Entry, Quadruple

if TYPE_CHECKING:
    from rbstab.proof.model import Energy


class ProvedEnergy(Entry):
    """The potential energy U of a proof, J, as exact operations (`rbstab.proof.record`).

    operations are carried out one after the other on the results of earlier ones; the last one is
    U. digest is that of the expression. U depends on Θ, the variables 0 to 2, and on those in
    `free`, over which it has its least value. stop is the largest |θ2| that a stop allows, rad, as
    a rational number. Of the angles in `closed` no motion reaches the end of the range.
    """

    operations: tuple[tuple[str | int, ...], ...]
    digest: str
    free: tuple[PositiveInt, ...] = ()
    stop: str | None = None
    closed: tuple[NonNegativeInt, ...] = ()

    @cached_property
    def energy(self) -> "Energy":
        """U as an exact expression.

        Raises:
            WrongRecordError: The operations describe none, or not the one with this digest.
        """
        from rbstab.proof.record import read_energy

        return read_energy(self.model_dump())

    @cached_property
    def has_springs(self) -> bool:
        """Whether it has springs of a body that is not held: it is not convex in z then."""
        from rbstab.proof.exact.lengths import springs_of

        return bool(self.free) and bool(springs_of(self.energy.U, self.free).lines)


class ProvedFamily(Entry):
    """Rest states of one energy, J, that form a curve (dimension 1), a surface (2) or SO(3) (3).

    index is the number of independent directions in which the energy falls.
    """

    energy: float
    index: NonNegativeInt
    dimension: PositiveInt


class OnRotations(Entry):
    """That the rest states are those among all rotations: the energy depends on no Euler angles.

    Then `Proof.states` are all rest states on SO(3), each once, also with θ2 = ±π/2, and no motion
    has a range to leave. quaternions has a unit quaternion of each of them, w first; the exact one
    is at most the entry of `radii` away, and its index is proved. If there are `families`, these
    are the isolated ones, `Proof.proved` is False, and both together are proved to be all.

    why is the first hypothesis of theorem 15 that is not known to hold; empty if all do. Then every
    motion exists for all times and converges to a rest state, and almost every one to a stable one.
    """

    quaternions: tuple[Quadruple, ...]
    radii: tuple[float, ...]
    why: str
    families: tuple[ProvedFamily, ...] = ()
