"""The runs of a report at a glance: how each ended, and by what numbers it is judged."""

from collections import Counter
from collections.abc import Sequence

from rbstab.analysis.certificate import Verdict
from rbstab.experiment.proof import Proof
from rbstab.integrate.status import RunStatus
from rbstab.report.model.document import Cell, Head, Table
from rbstab.report.model.words import NOTHING, counted, listed, number
from rbstab.report.runs.facts import RunFacts
from rbstab.sweep.members.outcome import SETTLED

CENTIMETRES = 100.0
"""In a metre: E is a matter of centimetres, as in the paper."""

HEADS = (
    Head("run"),
    Head("variant"),
    Head("status"),
    Head("verdict"),
    Head("v(0)", "J", numbers=True),
    Head("v(end)", "J", numbers=True),
    Head("|r|/v(0)", numbers=True),
    Head("peak E1", "cm", numbers=True),
    Head("peak E2", "cm", numbers=True),
    Head("peak E3", "cm", numbers=True),
    Head("peak |θ2|", "rad", numbers=True),
    Head("settled at", "s", numbers=True),
    Head("rest states", numbers=True),
    Head("in certified region"),
)

NOTE = (
    "v is the Lyapunov function and r what its integrated derivative leaves unexplained. Peak E is "
    "the displacement of the contact point farthest from zero, by axis; settled is v below "
    f"{SETTLED:g} v(0) for good. Rest states are those in the range of the Euler angles, and the "
    "certified region is where convergence is proved, both where a proof is kept beside the result "
    "(rbstab stability makes it)."
)

OF_WORK = (
    "Where the connector slides on s = F + κE, v - ε stands in place of v, with ε the work of the "
    "contact force; it does not end at zero. There, settled is said of v itself."
)
"""What has to be said besides where there are such runs."""

TONES: dict[str, str] = {Verdict.CERTIFIED: "good", Verdict.VIOLATED: "bad", Verdict.UNKNOWN: "odd"}
"""Of verdicts; what is seen to hold and not proved is neither good nor bad."""


def summary_table(facts: Sequence[RunFacts]) -> Table:
    """One row for each run."""
    note = f"{NOTE} {OF_WORK}" if any(one.run.counts_work for one in facts) else NOTE
    return Table("runs", "Runs", HEADS, tuple(_row(one) for one in facts), note)


def overview(facts: Sequence[RunFacts]) -> str:
    """How many runs there are, how they ended and what was found."""
    status = Counter(one.run.result.status for one in facts)
    verdict = Counter(one.attribute("verdict") or "of no certificate" for one in facts)
    runs = counted(len(facts), "run")
    return f"{runs}: {_counts(status)}; by their certificates: {_counts(verdict)}."


def verdict_cell(verdict: str, target: str = "") -> Cell:
    """A verdict with its tone."""
    return Cell(verdict or NOTHING, tone=TONES.get(verdict, ""), target=target)


def quantity(value: float, digits: int = 4) -> Cell:
    """A number as a cell."""
    return Cell(number(value, digits), value)


def _row(facts: RunFacts) -> tuple[Cell, ...]:
    s, status = facts.run.summary, facts.run.result.status
    completed = status == RunStatus.COMPLETED
    return (
        Cell(facts.run.label),
        Cell(facts.attribute("variant") or NOTHING),
        Cell(status if completed else f"{status} at {number(s.end_time)} s", tone=_tone(completed)),
        verdict_cell(facts.attribute("verdict"), "certificates"),
        quantity(s.lyapunov_start),
        quantity(s.lyapunov_end),
        quantity(s.relative_residual, 2),
        *(quantity(CENTIMETRES * peak) for peak in s.peak_contact_displacement),
        quantity(s.largest_pitch),
        quantity(facts.run.settling_time),
        _rest_states(facts.proof),
        _inside(facts.inside),
    )


def _tone(completed: bool) -> str:
    return "" if completed else "bad"


def _rest_states(proof: Proof | None) -> Cell:
    if proof is None:
        return Cell(NOTHING)
    count = len(proof.states)
    tone = {True: "good", False: "odd", None: ""}[proof.globally_stable]
    return Cell(str(count) if proof.proved else f"at least {count}", float(count), tone)


def _inside(inside: bool | None) -> Cell:
    return {
        True: Cell("yes", tone="good"),
        False: Cell("no"),
        None: Cell(NOTHING),
    }[inside]


def _counts(words: Counter[str]) -> str:
    return listed(f"{count} {word}" for word, count in words.most_common())
