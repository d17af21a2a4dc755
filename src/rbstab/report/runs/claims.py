"""Is each body globally stable? The claim of the paper, counterexamples, and what a barrier proves.

Runs of one body and controller, with and without barriers, are one row of the table. Everything
comes from stored results and the proofs stored beside them.
"""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import compress

from rbstab.config.load import acting_sections
from rbstab.config.schema import Config
from rbstab.experiment.answers.state_words import ALMOST, counterexample
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.integrate.status import RunStatus
from rbstab.report.model.document import Cell, Head, Section, Table
from rbstab.report.model.words import NO_VALUE, listed, number
from rbstab.report.runs.facts import RunFacts
from rbstab.report.runs.figures.landscape import Landscape, landscape_figure

CLAIM = "globally stable"
"""What the paper says of its controlled bodies, in the range of eq. 5."""

CLAIMED = ("free", "permanent", "visco-elastic", "embedded")
"""The variants of which the paper says so."""

HEADS = (
    Head("body and controller"),
    Head("without a barrier"),
    Head("with a barrier on θ2"),
    Head("counterexample"),
    Head("the paper on this variant"),
)
"""What is known comes before what is claimed: a narrow page shows only the first columns."""

OF_BARE, OF_GUARDED = (HEADS[1], HEADS[3]), (HEADS[2],)
"""The columns that only bodies without a barrier have, and only those with one."""

NOTE = (
    "Globally stable means here: every motion that starts in the range of the Euler angles, "
    "|θ2| < π/2, stays in it and converges to the rest state. Proved, and false with a second rest "
    "state, speak of the exact motions: of what is stored in the proofs beside the results. A run "
    "that leaves the range is a computed motion. A run with a barrier and one without it, of the "
    "same body and controller, share a row."
)

MAX_ROWS = 12
"""The most bodies that are shown; each has a panel of the figure."""


@dataclass(frozen=True)
class Body:
    """The runs of one body and controller, apart from their barriers.

    Args:
        bare: The runs without a barrier.
        guarded: The runs with one.
    """

    bare: tuple[RunFacts, ...]
    guarded: tuple[RunFacts, ...]

    @property
    def all(self) -> tuple[RunFacts, ...]:
        """All runs."""
        return (*self.bare, *self.guarded)


def claims_section(facts: Sequence[RunFacts]) -> Section | None:
    """Return the section; None if no run has a stored proof of its rest states."""
    bodies = [body for body in _bodies(facts) if any(map(_has_energy, body.all))]
    if not bodies:
        return None
    shown = bodies[:MAX_ROWS]
    rows = tuple(_row(body) for body in shown)
    sentences = (
        [f"Shown: {len(shown)} of {len(bodies)} bodies."] if len(shown) < len(bodies) else []
    )
    # A narrow page shows only the first columns: none of them may be empty.
    left_out = [*(() if any(body.bare for body in shown) else OF_BARE)]
    left_out += () if any(body.guarded for body in shown) else OF_GUARDED
    kept = [head not in left_out for head in HEADS]
    rows = tuple(tuple(compress(row, kept)) for row in rows)
    heads = tuple(compress(HEADS, kept))
    table = Table("claims", "Claims, counterexamples and proofs", heads, rows, NOTE)
    figure = landscape_figure([_landscape(body) for body in shown])
    return Section("stability", "Globally stable?", (*sentences, table, figure))


def _bodies(facts: Sequence[RunFacts]) -> Iterable[Body]:
    """Group runs by what acts on their body, apart from barriers."""
    groups: dict[str, list[RunFacts]] = {}
    for entry in facts:
        config = entry.run.config
        if config is not None and config.controller.variant in CLAIMED:
            groups.setdefault(_key(config), []).append(entry)
    for group in groups.values():
        guarded = tuple(entry for entry in group if _barriers(entry))
        yield Body(tuple(entry for entry in group if not _barriers(entry)), guarded)


def _key(config: Config) -> str:
    """Return what acts on the body but for barriers, as text."""
    sections = acting_sections(config)
    elements = sections.get("elements", {})
    others = {n: e for n, e in elements.items() if e.get("method") != "barrier"}
    return json.dumps(sections | {"elements": others}, sort_keys=True)


def _barriers(entry: RunFacts) -> list[float]:
    """Return the stiffnesses of the barriers of a run, N m."""
    config = entry.run.config
    elements = () if config is None else config.elements.values()
    return [one.stiffness for one in elements if getattr(one, "method", None) == "barrier"]


def _has_energy(entry: RunFacts) -> bool:
    return entry.proof is not None and entry.proof.reduced_energy is not None


def _row(body: Body) -> tuple[Cell, ...]:
    return (
        Cell(listed(entry.run.label for entry in body.all)),
        _without(body),
        _with(body),
        _counterexample(body),
        Cell(CLAIM),
    )


def _without(body: Body) -> Cell:
    """Return what is known of global stability without a barrier."""
    proofs = [entry.proof for entry in body.bare if entry.proof is not None]
    if not body.bare:
        return Cell(NO_VALUE)
    if any(proof.every_start for proof in proofs):
        return Cell("every start converges: proved (a stop)", tone="good")
    if any(proof.globally_stable is False for proof in proofs):
        return _almost(proofs)
    if any(map(_leaves, body.bare)):
        return Cell("false: a computed motion leaves the range", tone="bad")
    if any(proof.globally_stable for proof in proofs):
        text = "proved only for motions that keep a distance from θ2 = ±π/2"
        return Cell(text, tone="warning")
    return Cell("not decided", tone="warning")


def _almost(proofs: Sequence[Proof]) -> Cell:
    """Return what is known of almost every start, where not every start converges to one state."""
    for proof in proofs:
        almost = proof.almost_every_start
        if almost.proved:
            tone = "good" if almost.returns else "warning"
            outcome = f" ({almost.outcome})" if almost.outcome else ""
            return Cell(f"not every start; {ALMOST}: proved{outcome}", tone=tone)
    return Cell("false: proved", tone="bad")


def _counterexample(body: Body) -> Cell:
    """Return a rest state other than the lowest, or a run that leaves the range."""
    proofs = [entry.proof for entry in body.bare if entry.proof is not None]
    for other in filter(None, map(counterexample, proofs)):
        return Cell(f"the body can also rest at {other}")
    if any(proof.globally_stable is False for proof in proofs):
        return Cell("the only rest state in the range is not a minimum of the energy")
    for entry in filter(_leaves, body.bare):
        time = number(entry.run.summary.end_time)
        return Cell(f"{entry.run.label} leaves the range at {time} s")
    return Cell("none known" if body.bare else NO_VALUE)


def _with(body: Body) -> Cell:
    """Return what is proved with a barrier."""
    if not body.guarded:
        return Cell(NO_VALUE)
    for entry in body.guarded:
        if entry.proof is not None and entry.proof.every_start:
            stiffness = number(sum(_barriers(entry)))
            return Cell(f"every start converges: proved ({stiffness} N m)", tone="good")
    return Cell("not proved", tone="warning")


def _leaves(entry: RunFacts) -> bool:
    return bool(entry.run.result.status == RunStatus.RANGE_LEFT)


def _landscape(body: Body) -> Landscape:
    proofs = {
        len(_barriers(entry)) > 0: entry.proof for entry in reversed(body.all) if _has_energy(entry)
    }
    return Landscape(
        body.all[0].run.label,
        proofs.get(False),
        proofs.get(True),
        [entry.run for entry in body.bare],
        [entry.run for entry in body.guarded],
    )
