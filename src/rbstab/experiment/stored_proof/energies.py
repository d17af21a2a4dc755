"""The energy from which a stored proof follows, as plain data."""

from functools import cached_property
from typing import TYPE_CHECKING

from pydantic import NonNegativeInt, PositiveInt

from rbstab.experiment.stored_proof.entries import Entry

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
