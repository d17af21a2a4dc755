"""How far disturbances tilt the members of a sweep: the worst, how often, and what is proved."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rbstab.config.tolerances import decimal_text
from rbstab.experiment.answers.rounded import number, rounded_down, rounded_up
from rbstab.experiment.answers.wanted import angle_in_degrees
from rbstab.experiment.disturbed.bound import UNITS, names_of
from rbstab.files.text import grouped
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.numbers import Array
from rbstab.store.table import Table
from rbstab.sweep.folder.deciding import end_of
from rbstab.sweep.members.outcome import STATUSES
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.proofs.disturbed import (
    ELSEWHERE,
    LARGER,
    NO_PROOF,
    NOT_DECIDED,
    OTHER,
    PROVED,
    MemberBounds,
    member_bounds,
)

REASONS = {
    LARGER: "their disturbance may become larger",
    OTHER: "another load acts on them: of another kind, or a force at another point",
    ELSEWHERE: "they do not start where it is proved, with less tilt and V < ℓ",
}
"""Why a proved bound says nothing of members."""


@dataclass(frozen=True, eq=False)
class DisturbedAnswers:
    """How far disturbances tilt the members of a sweep whose plan states a bound.

    Args:
        bounds: What its proofs say of the members.
        peaks: The largest tilt of each member, rad; NaN if it is not known; shape (members,).
        completed: Whether its run completed, shape (members,).
        end: When the runs end, as text.
        independent: Whether the members are independent draws of one distribution.
        not_made: Why a body has no proof, and the command that makes it.
    """

    bounds: MemberBounds
    peaks: Array
    completed: Array
    end: str
    independent: bool
    not_made: str

    @property
    def left(self) -> Array:
        """Which members were seen to tilt farther, shape (members,)."""
        return self.peaks > float(self.bounds.stated.tilt)

    @property
    def unknown(self) -> int:
        """How many members ended early, and within the bound until then; or have no peak."""
        return int(np.count_nonzero(~self.left & (~self.completed | np.isnan(self.peaks))))

    @property
    def worst(self) -> int | None:
        """The member that tilts farthest; None if no tilt is known."""
        finite = np.isfinite(self.peaks)
        return int(np.argmax(np.where(finite, self.peaks, -1.0))) if finite.any() else None

    @property
    def interval(self) -> tuple[float, float] | None:
        """The 95 % interval of the probability to tilt farther; None if no chance chose members.

        Members of which it is not known count as both.
        """
        if not self.independent:
            return None
        count, total = int(self.left.sum()), len(self.left)
        return clopper_pearson(count, total)[0], clopper_pearson(count + self.unknown, total)[1]

    @property
    def why(self) -> dict[str, int]:
        """Why nothing is proved of members: their number by the reason."""
        whys = [b.why for b, _ in self.bounds.bodies if b is not None and b.claim is None]
        first = " (the first of their bodies)" if len(whys) > 1 else ""
        not_decided = f"it is not decided, as {next(iter(whys), '')}{first}"
        texts = REASONS | {NO_PROOF: self.not_made, NOT_DECIDED: not_decided}
        counts = np.bincount(self.bounds.codes, minlength=len(texts) + 1).tolist()
        return {text: counts[code] for code, text in texts.items() if counts[code]}

    @property
    def proved(self) -> int:
        """Of how many members it is proved that they never tilt as far."""
        return int(np.count_nonzero(self.bounds.codes == PROVED))

    @property
    def leaving(self) -> str:
        """How many members tilt farther, in words without a full stop."""
        count, total = int(self.left.sum()), len(self.left)
        share = f"{grouped(count)} of {grouped(total)} members ({number(100 * count / total, 3)} %)"
        text = f"tilt above {decimal_text(self.bounds.stated.tilt)} rad: {share} by {self.end}"
        if self.unknown:
            text += f"; not known of {grouped(self.unknown)} that ended early or have no peak"
        if self.interval is not None:
            low, high = (100.0 * end for end in self.interval)
            ends = f"{rounded_down(low, 3)} to {rounded_up(high, 3)} %"
            text += f". Probability: {ends} (95 % interval of Clopper and Pearson)"
        return text

    @property
    def statements(self) -> dict[str, str]:
        """Sentences without a full stop, by the words before them."""
        stated, bodies, sentences = self.bounds.stated, self.bounds.bodies, dict[str, str]()
        if self.worst is not None:
            k, peak = self.worst, float(self.peaks[self.worst])
            sizes = self.bounds.loads.largest.items()
            largest = [(name, a[k]) for name, a in sizes if 0 < a[k] < np.inf]
            loads = (f", {name} up to {number(size)} {UNITS[name]}" for name, size in largest)
            tilt = f"{number(peak)} rad ({angle_in_degrees(peak)}), member {k}"
            sentences = {"Worst tilt": tilt + "".join(loads), "Leaves": self.leaving}
        count = sum(bound is not None and bound.proved for bound, _ in bodies)
        some = f" for {grouped(count)} of {grouped(len(bodies))} bodies" if len(bodies) > 1 else ""
        any_load = f"any disturbance {names_of(tuple(stated.given), tuple(stated.given.values()))}"
        below = f"below {decimal_text(stated.tilt)} rad"
        word = f"proved{some}" if count else "not proved"
        sentences["Bound"] = (
            f"from rest at Θ = 0, {any_load} keeps the tilt {below} for ever: {word}"
        )
        parts = [f"not proved for {grouped(n)}: {why}" for why, n in self.why.items()]
        if self.proved:
            members = f"{grouped(self.proved)} of {grouped(len(self.peaks))} members"
            parts = [f"{members} stay {below}: proved", *parts]
        return sentences | {"For ever": "; ".join(parts)}

    @property
    def data(self) -> dict[str, Any]:
        """The same as data for JSON."""
        return {
            "worst_member": self.worst,
            "worst_tilt": None if self.worst is None else float(self.peaks[self.worst]),
            "left": int(self.left.sum()),
            "unknown": self.unknown,
            "interval": self.interval,
            "proved": self.proved,
            "not_proved": self.why,
            "statements": self.statements,
        }


def clopper_pearson(count: int, total: int) -> tuple[float, float]:
    """Return the ends of the 95 % interval of a probability: exact, at whatever probability.

    At the lower end, `count` or more of `total` occur with the probability 2.5 %; at the upper end,
    `count` or fewer.

    Source: C. Clopper and E. Pearson, Biometrika 26 (1934), p. 404.
    """
    # Imported late: it takes a while.
    from scipy.special import betaincinv

    tail = 0.025
    low = betaincinv(count, total - count + 1, tail) if count else 0.0
    high = betaincinv(count + 1, total - count, 1.0 - tail) if count < total else 1.0
    return float(low), float(high)


def disturbed_answers(
    plan: Plan, table: Table, results: Path, not_made: str
) -> DisturbedAnswers | None:
    """Return what is known of the tilt of members; None if the plan states no bound.

    Args:
        plan: The plan.
        table: Its table, with `status`, `end_time`; and `peak_tilt`, but for earlier versions.
        results: The folder of results, which keeps the proofs.
        not_made: Why a body has no proof, and the command that makes it.
    """
    bounds = member_bounds(plan, results)
    if bounds is None:
        return None
    peaks = table["peak_tilt"] if "peak_tilt" in table else np.full(plan.members, np.nan)
    completed = table["status"] == STATUSES.index(RunStatus.COMPLETED)
    drawn = plan.design is not None and plan.design.independent
    independent = drawn and list(plan.dimensions) == ["point"]
    return DisturbedAnswers(bounds, peaks, completed, end_of(table), independent, not_made)
