"""The energies of the prover, written as entries of a stored proof."""

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from rbstab.experiment.stored_proof.energies import (
    ProvedEnergy,
    ProvedFormula,
    ProvedFreeFormula,
    ProvedFreeLigament,
    ProvedFreeLine,
    ProvedGuard,
    ProvedKink,
    ProvedLigament,
    ProvedLine,
    ProvedOwnStates,
    ProvedPosition,
    ProvedRidge,
    ProvedTiedEnergy,
)

if TYPE_CHECKING:
    from rbstab.analysis.proof.guards.guard import Guard
    from rbstab.analysis.proof.ligaments.free import FreeLigament, FreeLigaments
    from rbstab.analysis.proof.tied.energy import TiedEnergy
    from rbstab.analysis.proof.trigonometric import TrigonometricForm


def energy_of(form: "TrigonometricForm") -> ProvedEnergy:
    """Return a reduced energy as plain data."""
    from rbstab.analysis.proof.ligaments.free import FreeLigaments
    from rbstab.analysis.proof.ligaments.held import LigamentLine
    from rbstab.analysis.proof.lines.line import Line
    from rbstab.analysis.proof.traced.energy import TracedEnergy
    from rbstab.analysis.proof.traced.kinked import KinkedEnergy
    from rbstab.analysis.proof.traced.own_states import OwnStatesEnergy

    guard = form.guard
    springs, ligaments, free = list[ProvedLine](), list[ProvedLigament](), None
    formulas, kinks, ridges = list[ProvedFormula](), list[ProvedKink](), list[ProvedRidge]()
    own_states = list[ProvedOwnStates]()
    for line in form.lines:
        if isinstance(line, Line):
            C = line.square.coefficients.tolist()
            springs.append(ProvedLine(weight=line.weight, coefficients=C))
        elif isinstance(line, LigamentLine):
            C = line.square.coefficients.tolist()
            ligaments.append(ProvedLigament(**vars(line.law), coefficients=C))
        elif isinstance(line, TracedEnergy):
            operations = line.program.operations
            formulas.append(ProvedFormula(name=line.name, operations=operations))
        elif isinstance(line, KinkedEnergy):
            operations = line.program.operations
            if line.ridge:
                ridges.append(ProvedRidge(name=line.name, operations=operations))
            else:
                kinks.append(ProvedKink(name=line.name, operations=operations))
        elif isinstance(line, OwnStatesEnergy):
            operations = line.program.operations
            own_states.append(
                ProvedOwnStates(name=line.name, states=line.count, operations=operations)
            )
        elif isinstance(line, FreeLigaments):
            free = _position_of(line)
    return ProvedEnergy(
        quadratic=form.quadratic.tolist(),
        linear=form.linear.tolist(),
        coefficients=form.coefficients.tolist(),
        barrier=_stiffness(guard),
        outer_barrier=_outer_stiffness(guard),
        soft_guards=None if guard is None else tuple(_soft_guards(guard)) or None,
        stop=None if guard is None else guard.stop,
        lines=tuple(springs) or None,
        ligaments=tuple(ligaments) or None,
        free_ligaments=free,
        formulas=tuple(formulas) or None,
        kinks=tuple(kinks) or None,
        ridges=tuple(ridges) or None,
        own_states=tuple(own_states) or None,
    )


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


def _position_of(free: "FreeLigaments") -> ProvedPosition:
    return ProvedPosition(
        stiffness=free.stiffness.tolist(), ligaments=tuple(map(_free_ligament, free.ligaments))
    )


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
