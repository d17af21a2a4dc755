"""For each minimum the component of {U < c} about it in which nothing else is at rest."""

from dataclasses import dataclass, replace

import numpy as np

from rbstab.analysis.proof.certified_region import CertifiedRegion, Face, energy_at_most
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.least_value import lower_bounds
from rbstab.analysis.proof.outcome import SearchOutcome
from rbstab.analysis.proof.regions.border_gates import border_gates, minimum_inside
from rbstab.analysis.proof.regions.downhill import Landscape
from rbstab.analysis.proof.regions.gates import Gate, minima_below, state_gate, undecided_gate
from rbstab.analysis.proof.rest_states import RestPoint, RestStates
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.mechanics.numbers import Array


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
    lowest = _LowestGates(landscape)
    _enter_inner_gates(lowest, rest)
    _enter_border_gates(lowest, border)
    regions = [
        _region(landscape.form, rest.states[state], state, gate)
        for state, gate in zip(states, lowest.gates, strict=True)
        if gate is not None
    ]
    return tuple(region for region in regions if region.lower_bound > 0)


def _is_minimum(point: RestPoint) -> bool:
    return point.proved and point.index_proved and point.index == 0


class _LowestGates:
    """The lowest known gate that may lead to each minimum."""

    def __init__(self, landscape: Landscape) -> None:
        self.landscape = landscape
        self.gates: list[Gate | None] = [None] * len(landscape.minima)
        # No gate below the minimum matters to it.
        self.floors = [
            float(lower_bounds(enclosure(landscape.form, box))[0]) for box in landscape.minima
        ]

    @property
    def single(self) -> bool:
        """Whether there is one minimum; then all ways down lead to it, if they end inside."""
        return len(self.gates) == 1

    @property
    def cap(self) -> float:
        """The energy at which no further gate matters, J."""
        levels = (np.inf if gate is None else gate.lower_bound for gate in self.gates)
        return max(levels, default=-np.inf)

    def enter(self, gate: Gate) -> None:
        """Enter a gate for each minimum to which it may lead, if no lower gate is known."""
        for minimum, known in enumerate(self.gates):
            is_lower = known is None or gate.lower_bound < known.lower_bound
            if gate.leads_to(minimum) and is_lower and gate.upper_bound > self.floors[minimum]:
                self.gates[minimum] = gate


def _enter_inner_gates(lowest: _LowestGates, rest: RestStates) -> None:
    """Enter the gates inside the border."""
    form = lowest.landscape.form
    gates = [
        (state_gate(form, point, state), point)
        for state, point in enumerate(rest.states)
        if point.proved and not _is_minimum(point)
    ]
    for gate, point in sorted(gates, key=lambda pair: pair[0].lower_bound):
        if gate.lower_bound >= lowest.cap:
            break
        below = None if lowest.single else minima_below(lowest.landscape, point, gate.lower_bound)
        lowest.enter(replace(gate, ends=below))
    undecided = undecided_gate(form, rest.undecided)
    if undecided is not None:
        lowest.enter(undecided)


def _enter_border_gates(lowest: _LowestGates, border: CertifiedRegion) -> None:
    """Enter the gates on the border, or one for all of it."""
    landscape = lowest.landscape
    if not border.faces:
        return
    face, least = min(border.faces.items(), key=lambda item: item[1].value)
    bound = min(found.lower_bound for found in border.faces.values())
    whole = Gate(least.value, bound, np.inf, least.Theta, face=face)
    if bound >= lowest.cap or (lowest.single and _falls_inwards(landscape.form, face, least.Theta)):
        lowest.enter(whole)
        return
    divided = border_gates(landscape, lowest.cap)
    if divided is None:
        lowest.enter(whole)
        return
    for one in divided:
        if one.gate.lower_bound >= lowest.cap:
            break
        ends = None if lowest.single else minimum_inside(landscape, one)
        # No gate on the border is below its least energy.
        raised = max(one.gate.lower_bound, bound)
        lowest.enter(replace(one.gate, lower_bound=raised, ends=ends))


def _falls_inwards(form: TrigonometricForm, face: Face, Theta: Array) -> bool:
    """Return whether U falls from a point of the border inwards; not proved.

    Then the lowest point of the border is most likely a gate, and the border need not be divided.
    """
    axis, sign = face.value
    return bool(sign * form.approximate(Theta[np.newaxis], 1)[1][0, axis] > 0)


def _region(form: TrigonometricForm, minimum: RestPoint, state: int, gate: Gate) -> MinimumRegion:
    height = gate.lower_bound - energy_at_most(form, minimum)
    return MinimumRegion(
        state,
        gate.energy - minimum.state.energy,
        max(0.0, float(np.nextafter(height, -np.inf))),
        gate.lower_bound,
        gate,
    )
