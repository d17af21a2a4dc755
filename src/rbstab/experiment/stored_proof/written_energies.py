"""The energies of the prover, written as entries of a stored proof."""

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from rbstab.experiment.stored_proof.energies import (
    ProvedFreeFormula,
    ProvedFreeLigament,
    ProvedFreeLine,
    ProvedGuard,
    ProvedTiedEnergy,
)

if TYPE_CHECKING:
    from rbstab.analysis.proof.guards.guard import Guard
    from rbstab.analysis.proof.ligaments.free import FreeLigament
    from rbstab.analysis.proof.tied.energy import TiedEnergy
    from rbstab.analysis.proof.trigonometric import TrigonometricForm


def _stiffness(guard: "Guard | None") -> float | None:
    """Return k of a barrier."""
    return None if guard is None or guard.barrier is None else guard.barrier.stiffness


def _outer_stiffness(guard: "Guard | None") -> float | None:
    """Return k of the barriers on θ1 and θ3."""
    return None if guard is None or guard.outer is None else guard.outer.stiffness


def _soft_guards(guard: "Guard") -> Iterator[ProvedGuard]:
    for one in guard.soft:
        if not one.is_stop:
            yield ProvedGuard(couple=one.couple, stiffness=one.stiffness, soft_angle=one.angle)


def _free_ligament(ligament: "FreeLigament") -> ProvedFreeLigament:
    return ProvedFreeLigament(**vars(ligament.law), offset=_tables(ligament.offset))


def _tables(forms: "Iterable[TrigonometricForm]") -> Any:
    """Return the coefficients of some forms."""
    return tuple(form.coefficients.tolist() for form in forms)


def tied_energy_of(energy: "TiedEnergy") -> ProvedTiedEnergy:
    """Return an energy of Θ and z as plain data."""
    guard = energy.form.guard
    return ProvedTiedEnergy(
        quadratic=energy.form.quadratic.tolist(),
        linear=energy.form.linear.tolist(),
        coefficients=energy.form.coefficients.tolist(),
        stiffness=energy.stiffness.tolist(),
        barrier=_stiffness(guard),
        outer_barrier=_outer_stiffness(guard),
        soft_guards=None if guard is None else tuple(_soft_guards(guard)) or None,
        lines=tuple(
            ProvedFreeLine(weight=line.weight, offset=_tables(line.offset)) for line in energy.lines
        ),
        ligaments=tuple(map(_free_ligament, energy.ligaments)) or None,
        position=_tables(energy.position) or None,
        formulas=tuple(
            ProvedFreeFormula(name=one.name, operations=one.program.operations)
            for one in energy.formulas
        )
        or None,
    )
