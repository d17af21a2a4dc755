"""For each minimum the component of {U < c} about it in which nothing else is at rest."""

from dataclasses import dataclass

import numpy as np

from rbstab.analysis.proof.branch_and_bound import SearchOutcome
from rbstab.analysis.proof.certified_region import CertifiedRegion
from rbstab.analysis.proof.regions.border_gates import border_gates
from rbstab.analysis.proof.regions.downhill import Landscape
from rbstab.analysis.proof.regions.gates import Gate, saddle_gate, undecided_gate
from rbstab.analysis.proof.rest_states import RestPoint, RestStates
from rbstab.analysis.proof.trigonometric import TrigonometricForm


@dataclass(frozen=True, eq=False)
class MinimumRegion:
    """The region of one minimum: every motion in it converges to this minimum.

    A motion is in the region if at some time its total energy is below `energy_bound`, J, and its Θ
    is in the component of {U < energy_bound} that contains the minimum.

    state is the index of the minimum among the rest states. level, J, is about the height of the
    lowest gate above the minimum; lower_bound, J, is proved. gate is that gate.
    """

    state: int
    level: float
    lower_bound: float
    energy_bound: float
    gate: Gate


def minimum_regions(rest: RestStates, border: CertifiedRegion | None) -> tuple[MinimumRegion, ...]:
    """Return the region of each proved minimum that has one, lowest minimum first.

    Args:
        rest: The rest states.
        border: The region of the lowest rest state, which has the least energy on each face.
    """
    if border is None or rest.outcome is SearchOutcome.SEARCHED:
        return ()
    states = [k for k, point in enumerate(rest.states) if _is_minimum(point)]
    minima = tuple(rest.states[k].enclosure for k in states)
    landscape = Landscape(rest.energy.form, minima, rest.end)
    gates = _inner_gates(rest, landscape)
    gates += _border_gates(border, landscape, gates)
    regions = []
    for minimum, state in enumerate(states):
        open_gates = [gate for gate in gates if gate.leads_to(minimum)]
        if not open_gates:
            continue
        lowest = min(open_gates, key=lambda gate: gate.lower_bound)
        region = _region(rest.energy.form, rest.states[state], state, lowest)
        if region.lower_bound > 0:
            regions.append(region)
    return tuple(regions)


def _is_minimum(point: RestPoint) -> bool:
    return point.proved and point.index_proved and point.index == 0


def _inner_gates(rest: RestStates, landscape: Landscape) -> list[Gate]:
    """Return the gates inside the border."""
    gates = [
        saddle_gate(landscape, point, state)
        for state, point in enumerate(rest.states)
        if point.proved and not _is_minimum(point)
    ]
    undecided = undecided_gate(landscape.form, rest.undecided)
    return gates if undecided is None else [*gates, undecided]


def _border_gates(border: CertifiedRegion, landscape: Landscape, inner: list[Gate]) -> list[Gate]:
    """Return the gates on the border, or one gate for all of it if it need not be divided."""
    face, lowest = min(border.faces.items(), key=lambda item: item[1].value)
    bound = min(least.lower_bound for least in border.faces.values())
    whole = Gate(lowest.value, bound, lowest.Theta, face=face)
    # Beyond the lowest inner gate of each minimum the border does not count.
    caps = [
        min((gate.lower_bound for gate in inner if gate.leads_to(k)), default=np.inf)
        for k in range(len(landscape.minima))
    ]
    cap = max(caps, default=-np.inf)
    if len(caps) < 2 or cap <= bound:
        return [whole]
    divided = border_gates(landscape, cap)
    # No gate on the border is below its least energy.
    return [whole] if divided is None else [_raised(gate, bound) for gate in divided]


def _raised(gate: Gate, bound: float) -> Gate:
    """Return a gate with a lower bound of at least another proved one."""
    lower_bound = max(gate.lower_bound, bound)
    return Gate(gate.energy, lower_bound, gate.Theta, face=gate.face, ends=gate.ends)


def _region(form: TrigonometricForm, minimum: RestPoint, state: int, gate: Gate) -> MinimumRegion:
    found = form.rigorous(minimum.Theta[np.newaxis], 0)[0]
    # U at a point of the enclosure bounds the energy of the minimum from above.
    height = gate.lower_bound - float(found.values[0] + found.error)
    return MinimumRegion(
        state,
        gate.energy - minimum.state.energy,
        max(0.0, float(np.nextafter(height, -np.inf))),
        gate.lower_bound,
        gate,
    )
