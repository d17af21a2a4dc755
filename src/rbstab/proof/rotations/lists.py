"""All rest states on SO(3): the exact ones of a quadratic form, or those of a search."""

import numpy as np

from rbstab.proof.enclosures.bounds import BoundedEnergy
from rbstab.proof.rotations.charts import searched_states
from rbstab.proof.rotations.davenport import eigen_states, matrix_of
from rbstab.proof.rotations.energy import ENTRIES, RotationEnergy
from rbstab.proof.rotations.forms import Form, in_chart, parts
from rbstab.proof.rotations.states import FAMILIES, RestRotation, Rotations, against_morse
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
        rotations = eigen_states(matrix_of(form))
        why = rotations.why or ("" if rotations.families else against_morse(_indices(rotations)))
        return Rotations(rotations.states, 0, why, rotations.families)
    turns = symmetries(energy.U)
    if turns:
        about = ", or ".join(turn.words for turn in turns)
        why = f"turns about {about} do not change the energy, so {FAMILIES}"
        return Rotations((), 0, why)
    return searched_states(energy, limit)


def quadratic_form(energy: RotationEnergy) -> Form | None:
    """Return U as a form over N; None if it is more than that."""
    terms = list(parts(energy.U))
    if not terms:
        terms = [((), Form(energy.U, 0))]
    ((rest, form), *others) = terms
    return None if others or rest or form.power > 1 or energy.free else form


def configuration_at(energy: RotationEnergy, state: RestRotation) -> dict[int, float]:
    """Return X and own states at a rest state, to round-off, by their numbers in a configuration.

    Of a body that is held, X is not among them.
    """
    values = np.zeros(ENTRIES + 9)
    values[ENTRIES:] = state.rotation.ravel()
    if energy.free:
        assert state.zero is not None
        V = BoundedEnergy(in_chart(energy.U, state.chart), free=energy.free)
        values[list(energy.free)] = V.minimiser(state.zero.point[:, None]).z[:, 0]
    values = energy.completed(values)
    return {k: float(values[k]) for k in (*energy.free, *energy.minimiser)}


def _indices(rotations: Rotations) -> list[int]:
    return [state.index for state in rotations.states]
