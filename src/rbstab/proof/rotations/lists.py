"""All rest states on SO(3) of a system: the exact ones of a quadratic form, or those of a search."""

from rbstab.proof.rotations.charts import searched_states
from rbstab.proof.rotations.davenport import eigen_states, matrix_of
from rbstab.proof.rotations.energy import RotationEnergy
from rbstab.proof.rotations.forms import Form, parts
from rbstab.proof.rotations.states import Rotations, against_morse
from rbstab.proof.rotations.symmetries import symmetries


def rest_rotations(energy: RotationEnergy, limit: int) -> Rotations:
    """Return the rest states among all rotations, or families of them.

    A quadratic form of the quaternion needs no search. With a continuous symmetry, rest states that
    it moves lie on curves of others, so none is searched for.

    Args:
        energy: The energy.
        limit: The largest number of boxes in each of the four charts.
    """
    form = quadratic_form(energy)
    if form is not None:
        found = eigen_states(matrix_of(form))
        why = found.why or ("" if found.families else against_morse(_indices(found)))
        return Rotations(found.states, 0, why, found.families)
    turns = symmetries(energy.U)
    if turns:
        about = ", or ".join(turn.words for turn in turns)
        why = f"turns about {about} do not change the energy, so rest states form families"
        return Rotations((), 0, why)
    return searched_states(energy, limit)


def quadratic_form(energy: RotationEnergy) -> Form | None:
    """Return U as a form over N; None if it is more than that."""
    found = list(parts(energy.U))
    if not found:
        found = [((), Form(energy.U, 0))]
    ((rest, form), *others) = found
    return None if others or rest or form.power > 1 or energy.free else form


def _indices(found: Rotations) -> list[int]:
    return [state.index for state in found.states]
