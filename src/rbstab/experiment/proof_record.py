"""A proof as plain data: its models, and their making from what was proved."""

from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)

from rbstab.mechanics.numbers import Array
from rbstab.store.cards import card, line

if TYPE_CHECKING:
    from rbstab.analysis.proof.boxes import Boxes
    from rbstab.analysis.proof.certified_region import CertifiedRegion, Face
    from rbstab.analysis.proof.lines.line import Line
    from rbstab.analysis.proof.lines.searched import SearchedState
    from rbstab.analysis.proof.regions.minimum_regions import MinimumRegion
    from rbstab.analysis.proof.rest_states import RestPoint, RestStates
    from rbstab.analysis.proof.tied.energy import TiedEnergy
    from rbstab.analysis.proof.tied.region import TiedRegion
    from rbstab.analysis.proof.tied.rest_states import TiedPoint, TiedRestStates
    from rbstab.analysis.proof.trigonometric import TrigonometricForm

NO_STABILIZERS = "no stabilizers damp every motion"
"""Why nothing is proved of a config without a controller."""

SUPPLIES = "an input supplies power"
"""Why nothing is proved of a config with inputs."""

Triple = tuple[float, float, float]

NO_LENGTH = "a spring without length"
"""Where c* is attained, if not on a face of the range nor at a rest state."""

OF_ELEMENTS = ("barrier", "every_start", "lines", "shift", "tied_energy")
"""Entries that a file has only with a barrier or a spring."""


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    @model_serializer(mode="wrap")
    def _serialized(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out what only some elements have, so that all other files are as they were."""
        data: dict[str, Any] = handler(self)
        return {key: data[key] for key in data if key not in OF_ELEMENTS or data[key] is not None}


class ProvedState(_Model):
    """One rest state: Θ, X and D, and its potential energy, J.

    index is the number of independent directions in which the energy decreases. index_proved is
    whether it is proved; None in proofs of version 1, which computed it in doubles.

    enclosure is a box of Θ, from low to high. If `proved`, it contains exactly this rest state.
    Of a tied body with springs, it is the only one there with z in the box `shift`, m.
    """

    orientation: Triple
    position: Triple
    connector_state: tuple[float, ...]
    energy: float
    index: NonNegativeInt
    proved: bool
    enclosure: tuple[Triple, Triple]
    index_proved: bool | None = None
    shift: tuple[Triple, Triple] | None = None


class ProvedRegion(_Model):
    """Motions with v < level converge to the lowest rest state; proved for v < lower_bound, J.

    energy is c*, J. It is attained at the orientation `attained_at`: on the named face of the
    range, at another rest state (face None), or where a spring has no length (`NO_LENGTH`).

    energy_bound is the same bound for the sum of all energies, J: each motion that at some time is
    in the range with less energy converges to the lowest rest state. None: not proved, or not
    stored (version 1).
    """

    energy: float
    level: float
    lower_bound: float
    attained_at: Triple
    face: str | None
    proved: bool
    energy_bound: float | None = None


class ProvedMinimum(_Model):
    """The region of one minimum: motions in it converge to this rest state, proved.

    A motion is in the region if at some time the sum of its energies is below `energy_bound`, J,
    and its Θ is in the component of {U < energy_bound} that contains the rest state.

    rest_state is its number, from 1 for the lowest. level is the height of its pass above it, J;
    lower_bound is proved. The pass is at the rest state with the number `pass_state`, or on the
    face `pass_face` of the range. If both are None it is not located: a box is undecided.
    pass_at is its Θ.
    """

    rest_state: PositiveInt
    level: float
    lower_bound: float
    energy_bound: float
    pass_state: PositiveInt | None
    pass_face: str | None
    pass_at: Triple | None


Table = tuple[tuple[tuple[float, ...], ...], ...]
"""C of a sum Σ C_abc t_a(θ1) t_b(θ2) t_c(θ3), of shape (n, n, n) with an odd n."""


def _checked(table: Table) -> Table:
    """Raise `ValueError` if a table of coefficients has another shape."""
    size = len(table)
    rows = [row for block in table for row in block]
    if size % 2 != 1 or any(len(part) != size for part in (*table, *rows)):
        raise ValueError("the coefficients have another shape")
    return table


Coefficients = Annotated[Table, AfterValidator(_checked)]


class ProvedLine(_Model):
    """The length of a line in an energy: w √s(Θ), J, with s = Σ C_abc t_a(θ1) t_b(θ2) t_c(θ3), m².

    weight is w, N. Each number is the exact one rounded once.
    """

    weight: float
    coefficients: Coefficients

    @property
    def line(self) -> "Line":
        """The line, which can be evaluated with proved errors.

        Raises:
            NoLength: It may have no length.
        """
        from rbstab.analysis.proof.lines.shortest import line_of
        from rbstab.analysis.proof.trigonometric import TrigonometricForm

        C = np.array(self.coefficients)
        return line_of(self.weight, TrigonometricForm(np.zeros((3, 3)), np.zeros(3), C))


class ProvedEnergy(_Model):
    """The reduced energy U of a proof, J: ½ Θ'QΘ + q'Θ + Σ C_abc t_a(θ1) t_b(θ2) t_c(θ3).

    t is [1, cos θ, sin θ, cos 2θ, ...]. With a barrier on θ2, U has the term ½ k tan² θ2 too, and
    barrier is k, N m; None without one. With springs, U has the lengths of their lines too; lines
    is None without one. Each number is the exact one rounded once.
    """

    quadratic: tuple[Triple, Triple, Triple]
    linear: Triple
    coefficients: Coefficients
    barrier: PositiveFloat | None = None
    lines: tuple[ProvedLine, ...] | None = None

    @property
    def form(self) -> "TrigonometricForm":
        """U as a form that can be evaluated with proved errors."""
        from rbstab.analysis.proof.guard import Guard
        from rbstab.analysis.proof.trigonometric import TrigonometricForm

        quadratic, linear = np.array(self.quadratic), np.array(self.linear)
        guard = None if self.barrier is None else Guard(self.barrier)
        lines = tuple(one.line for one in self.lines or ())
        C = np.array(self.coefficients)
        return TrigonometricForm(quadratic, linear, C, guard=guard, lines=lines)


class ProvedFreeLine(_Model):
    """The length of a line in an energy of Θ and z: w |z + r(Θ)|, J.

    weight is w, N. offset has the coefficients of the three entries of r, m, as those of
    `ProvedEnergy`. Each number is the exact one rounded once.
    """

    weight: float
    offset: tuple[Coefficients, Coefficients, Coefficients]


class ProvedTiedEnergy(_Model):
    """The energy W of a proof for a tied body with springs, J: U(Θ) + ½ z'Sz + Σ w_j |z + r_j(Θ)|.

    z is X minus its value without lines. U is ½ Θ'QΘ + q'Θ + Σ C_abc t_a(θ1) t_b(θ2) t_c(θ3), and
    stiffness is S, N/m. Each number is the exact one rounded once.
    """

    quadratic: tuple[Triple, Triple, Triple]
    linear: Triple
    coefficients: Coefficients
    stiffness: tuple[Triple, Triple, Triple]
    lines: tuple[ProvedFreeLine, ...]


class ProvedStates(_Model):
    """The rest states in a range of Θ, lowest first, and the regions of the minima.

    outcome describes how the search ended, or gives the reason why there is no proof. proved is
    True if `states` are proved to be all rest states. unique is True if there is exactly one (None:
    not known). examined is the number of boxes that the search examined. undecided are boxes of Θ
    that may contain more rest states.

    region holds in all of the range. regions has a region of each minimum that has one, in the
    order of the states.
    """

    outcome: str
    proved: bool
    unique: bool | None
    examined: NonNegativeInt
    undecided: tuple[tuple[Triple, Triple], ...]
    states: tuple[ProvedState, ...]
    region: ProvedRegion | None
    regions: tuple[ProvedMinimum, ...] = ()

    @model_validator(mode="after")
    def _check_states(self) -> Self:
        count = len(self.states)
        if (self.unique is not None and self.unique != (count == 1)) or (self.region and not count):
            raise ValueError("the number of states does not fit the other entries")
        if any(max(one.rest_state, one.pass_state or 1) > count for one in self.regions):
            raise ValueError("a region belongs to a state that is not listed")
        return self

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


class UnwrappedStates(ProvedStates):
    """The rest states with |θ2| < π/2 and any real θ1 and θ3, and the regions of the minima.

    All of them have |Θ| < end, rad; regions end there too. They are not in `Proof.states` if they
    are beyond the range of eq. 5. A motion leaves this range only through θ2 = ±π/2.

    every_start is true if a barrier keeps every motion away from θ2 = ±π/2 and there is one rest
    state, a minimum: then c* is infinite, and every motion that starts with |θ2| < π/2 converges to
    it. There is no region then, as none is needed. None: not proved.
    """

    end: Triple
    every_start: Literal[True] | None = None

    @model_validator(mode="after")
    def _check_every_start(self) -> Self:
        if self.every_start and not (self.proved and self.globally_stable):
            raise ValueError("not every start converges to the only rest state")
        return self


class Proof(ProvedStates):
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
        region: The certified region. If `region.proved`, every motion with v < `region.lower_bound`
            converges to the lowest rest state; v is the energy above it, J. None: no region.
        regions: A region of each minimum that has one: `rest_state` is its number from 1, and
            `lower_bound` the proved depth of its valley, J.
        undecided: Boxes of Θ, rad, which may contain more rest states.
        examined: The number of boxes that the search examined.
        unwrapped: The same for all real θ1 and θ3. None in proofs of version 1, after a search
            without a proof, and where θ1 and θ3 have no bound that is small enough for a proof.
        reduced_energy: U(Θ), the stored energy at given angles, J. None in proofs of version 1, and
            for a tied body with springs.
        tied_energy: The energy W of a tied body with springs, J; its rest states are those at which
            no spring has length zero. None for other bodies.
        id: A checksum of the body, its gravity, what acts on it, and the equations.
        seconds: The time that the proof took, s.
    """

    id: str
    seconds: float
    reduced_energy: ProvedEnergy | None = None
    unwrapped: UnwrappedStates | None = None
    tied_energy: ProvedTiedEnergy | None = None

    def __repr__(self) -> str:
        """Return one line: the rest states, and how the proof ended."""
        count = len(self.states)
        found = f"{count} rest state{'' if count == 1 else 's'}"
        ended = "proved to be all" if self.proved else self.outcome
        return line("Proof", "", [found, ended, f"{self.examined} boxes"])

    def _repr_html_(self) -> str:
        """Return a card for notebooks, with the sentences of the proof."""
        # Imported late: the sentences stand on this module.
        from rbstab.experiment.stability import statements_of

        sentences = [text.partition(": ") for text in statements_of(self)]
        facts = [(name, text) for name, _, text in sentences]
        return card("Proof", "Rest states and regions", facts)

    @property
    def has_energy(self) -> bool:
        """Whether the proof contains the energy (U or W) on which it is based; not in version 1."""
        return self.reduced_energy is not None or self.tied_energy is not None

    @property
    def has_barrier(self) -> bool:
        """Whether a barrier keeps every motion away from θ2 = ±π/2."""
        return self.reduced_energy is not None and self.reduced_energy.barrier is not None

    @property
    def every_start(self) -> bool:
        """Whether every motion that starts with |θ2| < π/2 converges to the only rest state."""
        wide = self.unwrapped
        return self.has_barrier and wide is not None and wide.every_start is True


def no_proof(identity: str, reason: str, seconds: float) -> Proof:
    """Return the record of a config that has no proof, with the reason."""
    return Proof(
        id=identity,
        outcome=reason,
        proved=False,
        unique=None,
        examined=0,
        seconds=seconds,
        undecided=(),
        states=(),
        region=None,
    )


def searched_record(identity: str, states: "list[SearchedState]", seconds: float) -> Proof:
    """Return the record of rest states that were looked for, where no energy of Θ alone exists."""
    from rbstab.analysis.proof.boxes import box_around
    from rbstab.analysis.proof.branch_and_bound import SearchOutcome
    from rbstab.analysis.proof.rest_states import RestPoint

    points = [
        RestPoint(
            one.state,
            one.index,
            box_around(one.state.motion.Theta, 0.0),
            proved=False,
            index_proved=False,
        )
        for one in states
    ]
    nothing = no_proof(identity, SearchOutcome.SEARCHED.value, seconds)
    return nothing.model_copy(update={"states": tuple(_state(point) for point in points)})


class Found(NamedTuple):
    """What was proved in one range of Θ.

    Attributes:
        rest: The rest states.
        region: The region of the lowest.
        regions: The region of each minimum.
    """

    rest: "RestStates"
    region: "CertifiedRegion | None"
    regions: "tuple[MinimumRegion, ...]"


def proof_record(identity: str, found: Found, unwrapped: Found | None, seconds: float) -> Proof:
    """Return what was proved as plain data.

    Args:
        identity: The id of the proof.
        found: What was proved in the range of eq. 5.
        unwrapped: The same for all real θ1 and θ3, or None.
        seconds: The time that it took.
    """
    wide = None
    if unwrapped is not None:
        rest = unwrapped.rest
        wide = UnwrappedStates(
            end=_triple(rest.end), every_start=rest.every_start or None, **_entries(unwrapped)
        )
    return Proof(
        id=identity,
        seconds=seconds,
        reduced_energy=energy_of(found.rest.energy.form),
        unwrapped=wide,
        **_entries(found),
    )


def tied_record(
    identity: str, rest: "TiedRestStates", unwrapped: "TiedRestStates | None", seconds: float
) -> Proof:
    """Return what was proved of a tied body with springs as plain data.

    Args:
        identity: The id of the proof.
        rest: What was proved in the range of eq. 5.
        unwrapped: The same for all real θ1 and θ3, or None.
        seconds: The time that it took.
    """
    wide = None
    if unwrapped is not None:
        wide = UnwrappedStates(end=_triple(unwrapped.end), **_tied_entries(unwrapped))
    return Proof(
        id=identity,
        seconds=seconds,
        tied_energy=tied_energy_of(rest.energy),
        unwrapped=wide,
        **_tied_entries(rest),
    )


def _tied_entries(rest: "TiedRestStates") -> dict[str, Any]:
    """Return the fields of `ProvedStates`."""
    region = rest.region
    return {
        "outcome": rest.outcome.value,
        "proved": rest.proved,
        "unique": rest.unique,
        "examined": rest.examined,
        "undecided": _hulls(rest.undecided),
        "states": tuple(_tied_state(one) for one in rest.states),
        "region": None if region is None else _tied_region(region, rest),
    }


def _tied_state(one: "TiedPoint") -> ProvedState:
    return _state(one.point).model_copy(update={"shift": _corners(one.shift)})


def _tied_region(region: "TiedRegion", rest: "TiedRestStates") -> ProvedRegion:
    face = None if region.face is None else _face_name(region.face, rest.end)
    lowest = rest.states[0].point.state.energy
    return ProvedRegion(
        energy=region.energy,
        level=region.energy - lowest,
        lower_bound=region.lower_bound,
        attained_at=_triple(region.attained_at),
        face=face if region.line is None else NO_LENGTH,
        proved=rest.proved and region.energy_bound is not None,
        energy_bound=region.energy_bound,
    )


def tied_energy_of(energy: "TiedEnergy") -> ProvedTiedEnergy:
    """Return an energy of Θ and z as plain data."""
    return ProvedTiedEnergy(
        quadratic=energy.form.quadratic.tolist(),
        linear=energy.form.linear.tolist(),
        coefficients=energy.form.coefficients.tolist(),
        stiffness=energy.stiffness.tolist(),
        lines=tuple(
            ProvedFreeLine(
                weight=line.weight, offset=tuple(one.coefficients.tolist() for one in line.offset)
            )
            for line in energy.lines
        ),
    )


def _entries(found: Found) -> dict[str, Any]:
    """Return the fields of `ProvedStates`."""
    rest, region = found.rest, found.region
    return {
        "outcome": rest.outcome.value,
        "proved": rest.proved,
        "unique": rest.unique,
        "examined": rest.examined,
        "undecided": _hulls(rest.undecided),
        "states": tuple(_state(point) for point in rest.states),
        "region": None if region is None else _region(region, rest.end),
        "regions": tuple(_minimum(one, rest.end) for one in found.regions),
    }


def _hulls(undecided: "Boxes") -> tuple[tuple[Triple, Triple], ...]:
    from rbstab.analysis.proof.boxes import hulls

    merged = hulls(undecided)
    ends = zip(merged.low.tolist(), merged.high.tolist(), strict=True)
    return tuple((_triple(low), _triple(high)) for low, high in ends)


def _state(point: "RestPoint") -> ProvedState:
    rest, box = point.state, point.enclosure
    return ProvedState(
        orientation=_triple(rest.motion.Theta),
        position=_triple(rest.motion.X),
        connector_state=tuple(map(float, rest.own)),
        energy=rest.energy,
        index=point.index,
        proved=point.proved,
        enclosure=_corners(box),
        index_proved=point.index_proved,
    )


def _region(region: "CertifiedRegion", end: Array) -> ProvedRegion:
    return ProvedRegion(
        energy=region.energy,
        level=region.level,
        lower_bound=region.lower_bound,
        attained_at=_triple(region.attained_at),
        face=None if region.face is None else _face_name(region.face, end),
        proved=region.proved,
        energy_bound=region.energy_bound,
    )


def _minimum(region: "MinimumRegion", end: Array) -> ProvedMinimum:
    gate = region.gate
    return ProvedMinimum(
        rest_state=region.state + 1,
        level=region.level,
        lower_bound=region.lower_bound,
        energy_bound=region.energy_bound,
        pass_state=None if gate.state is None else gate.state + 1,
        pass_face=None if gate.face is None else _face_name(gate.face, end),
        pass_at=None if gate.Theta is None else _triple(gate.Theta),
    )


def energy_of(form: "TrigonometricForm") -> ProvedEnergy:
    """Return a reduced energy as plain data."""
    return ProvedEnergy(
        quadratic=form.quadratic.tolist(),
        linear=form.linear.tolist(),
        coefficients=form.coefficients.tolist(),
        barrier=None if form.guard is None else form.guard.stiffness,
        lines=tuple(
            ProvedLine(weight=line.weight, coefficients=line.square.coefficients.tolist())
            for line in form.lines
        )
        or None,
    )


def _face_name(face: "Face", end: Array) -> str:
    from rbstab.analysis.proof.boxes import RANGE_END

    axis, sign = face.value
    name = "π/2" if axis == 1 else "π"
    if end[axis] != RANGE_END[axis]:
        name = f"{end[axis]:.4g}"
    return f"θ{axis + 1} = {'-' if sign < 0 else ''}{name}"


def _corners(box: "Boxes") -> tuple[Triple, Triple]:
    return _triple(box.low[0]), _triple(box.high[0])


def _triple(values: Array | list[float]) -> Triple:
    a, b, c = (float(value) for value in values)
    return a, b, c
