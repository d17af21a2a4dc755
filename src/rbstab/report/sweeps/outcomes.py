"""How the members ended, and how their quantities are distributed.

Members of different conditions are never one distribution: how often a value occurs would then
depend on how many members of each condition the plan has. Each condition has a row and a curve of
its own.
"""

import numpy as np

from rbstab.analysis.lyapunov import ENERGY_SCALE
from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Block, Entry, Table
from rbstab.report.model.figure import SHARE_ENDS, Axis, Figure, Line, Panel, Shares
from rbstab.report.sweeps.conditions.paired_conditions import Slice, conditions_of
from rbstab.report.sweeps.members import (
    FAILED,
    OUTCOMES,
    Members,
)
from rbstab.report.sweeps.quantiles import quantiles_of
from rbstab.report.sweeps.quantities import MemberQuantity, main_quantities, outcome_words
from rbstab.sweep.folder.members_file import relative_residuals
from rbstab.sweep.members.outcome import STATUSES
from rbstab.sweep.proofs.columns import NO_PROOF, PROVED

CONFIDENCE = 0.95

PROVED_LABEL = "proved to converge"

Z = 1.959963984540054
"""The quantile of the normal distribution with (1 - 0.95) / 2 above it."""

GRID_NOTE = (
    "These are fractions of the grid points. Grid points are chosen, not sampled. So the fractions "
    "do not estimate probabilities, and they have no confidence intervals."
)
NO_PLAN_NOTE = (
    "The plan cannot be read. It is not known whether the members are sampled, so there are no "
    "confidence intervals."
)
POOLED_NOTE = (
    "These fractions pool conditions that are chosen, not sampled, so there are no confidence "
    "intervals."
)
WILSON_NOTE = (
    "The limits are those of the share among all possible members, of which these are a sample, "
    f"with {CONFIDENCE:.0%} confidence (Wilson interval)."
)
EVEN_DESIGN_NOTE = (
    " They assume independent points. The points of this design are spread more evenly "
    "than that, so the shares are usually more accurate than the limits suggest."
)


QUANTILES = {"median": 0.5, "5%": 0.05, "95%": 0.95, "minimum": 0.0, "maximum": 1.0}
"""Orders of the quantiles; the median comes first: a narrow page shows only the first columns."""

NOTE = "Only completed members count. The smallest cos θ2 includes members that left the range."

MAX_CURVES = 7
"""If there are more conditions, their curves are not drawn: more colours cannot be told apart."""

CURVE_ORDERS = np.linspace(0.0, 1.0, 201)
"""Orders of the quantiles that a curve has as its points."""

CAPTION = (
    "At each value: the share of members that have this value or a smaller one. A curve that ends "
    "below 1 has members without a value."
)


def wilson(counts: Array, totals: Array) -> tuple[Array, Array, Array]:
    """Return shares p = k/n, and the ends of Wilson's interval; NaN where n is 0.

    Its ends are the q with |p - q| = z √(q (1 - q) / n):
    (p + z²/2n ± z √(p (1 - p) / n + z²/4n²)) / (1 + z²/n).

    Args:
        counts: The numbers k of members with a property, shape (m,).
        totals: The numbers n of members, shape (m,).
    """
    with np.errstate(all="ignore"):
        p, spread = counts / totals, Z**2 / totals
        middle = (p + spread / 2) / (1 + spread)
        half = np.sqrt(spread * p * (1 - p) + spread**2 / 4) / (1 + spread)
    return p, np.clip(middle - half, 0.0, 1.0), np.clip(middle + half, 0.0, 1.0)


def is_sampled(members: Members) -> bool:
    """Return whether the members are a sample, so that their fractions estimate probabilities."""
    plan = members.plan
    return plan is not None and plan.design is not None and list(plan.dimensions) == ["point"]


def interval_note(members: Members, has_intervals: bool) -> str:
    """Return a note on the meaning of the intervals, or on why there are none."""
    plan = members.plan
    if plan is None:
        return NO_PLAN_NOTE
    if plan.design is None:
        return GRID_NOTE
    if not has_intervals:
        return POOLED_NOTE
    return WILSON_NOTE if plan.design.independent else WILSON_NOTE + EVEN_DESIGN_NOTE


def outcome_table(name: str, members: Members) -> Table:
    """Return how many members ended how, of each condition if there are several."""
    slices, drawn = conditions_of(members).slices, members.is_drawn
    # Conditions that are too many to compare are pooled.
    has_limits = drawn and (len(slices) > 1 or is_sampled(members))
    limits = (f"{end} {CONFIDENCE:.0%} limit" for end in ("lower", "upper"))
    heads = "outcome", "condition", "members", "fraction", *limits
    rows = []
    for label, has in _properties(members).items():
        for part in slices:
            # Proofs may reach only some members: then this is no fraction of all of them.
            untried = members.convergence[part.chosen] == NO_PROOF
            if label == PROVED_LABEL and (untried.any() or len(slices) < 2):
                continue
            count, total = int(np.count_nonzero(has[part.chosen])), len(part.chosen)
            share, *ends = map(float, wilson(np.array(count), np.array(total)))
            rows.append((label, part.title, count, share, *(ends if has_limits else ("", ""))))
    note = f"{interval_note(members, has_limits)} At rest: {members.sweep_outcomes.at_rest}."
    title = "Outcomes of the members"
    return Table.of(f"{name}-fractions", title, heads, rows, note)


def outcome_bars(name: str, members: Members) -> list[Figure]:
    """Return how the members of each condition ended, as bars; [] if all ended alike."""
    slices, word = conditions_of(members).slices[::-1], outcome_words(members)
    words = word.axis.categories
    if len(slices) < 2 or len(words) < 2:
        return []
    outcomes = (word.values[part.chosen].astype(int) for part in slices)
    counts = np.array([np.bincount(codes, minlength=len(words)) for codes in outcomes])
    # The first one is the highest.
    y = Axis("", categories=tuple(part.title for part in slices))
    shares = Shares(counts, words, word.axis.colours)
    panel = Panel(Axis("share of the members", ends=(0.0, 1.0)), y, (shares,))
    caption = "The numbers in the bars count members."
    return [Figure(f"{name}-outcomes", "How the members ended", (panel,), caption=caption)]


def _properties(members: Members) -> dict[str, Array]:
    """Return who has each outcome, how runs failed, and others: masks of shape (n,)."""
    status, outcomes = members.column("status"), members.outcomes
    masks = {
        word: outcomes == code for code, word in enumerate(OUTCOMES) if members.outcome_counts[code]
    }
    for code in np.unique(status[outcomes == FAILED]).tolist():
        failed = (status == code) & (outcomes == FAILED)
        masks[f"{OUTCOMES[FAILED]}: {STATUSES[code]}"] = failed
    near = np.isfinite(members.column("displacement_settling_time"))
    return masks | {
        "completed": members.completed,
        "completed, |E| below 1 mm from some time on": members.completed & near,
        PROVED_LABEL: members.convergence == PROVED,
    }


def spread_figures(name: str, members: Members) -> list[Figure]:
    """Return the cumulative distributions of drawn members, or of each condition.

    How often a value occurs in a grid only says how its points were chosen.
    """
    slices = conditions_of(members).slices
    if not (members.is_drawn or len(slices) > 1) or len(slices) > MAX_CURVES:
        return []
    y = Axis("share of members", ends=SHARE_ENDS)
    shown = [quantity for quantity in main_quantities(members) if quantity.varies]
    panels = tuple(Panel(q.axis, y, _curves(q, slices)) for q in shown)
    title = "Distributions over the members"
    return [Figure(f"{name}-cumulative", title, panels, 3, caption=CAPTION)] if panels else []


def _curves(quantity: MemberQuantity, slices: list[Slice]) -> tuple[Line, ...]:
    """Return the empirical distribution function of each condition that has values."""
    curves = []
    for k, part in enumerate(slices):
        values = quantity.values[part.chosen]
        finite = values[np.isfinite(values)]
        if len(finite):
            x = np.quantile(finite, CURVE_ORDERS, method="inverted_cdf")
            y = CURVE_ORDERS * len(finite) / len(values)
            curves.append(Line(x, y, part.title, colour=k))
    return tuple(curves)


def quantile_table(name: str, members: Members) -> Block:
    """Return quantiles of the members, of each condition if there are several."""
    residuals = np.where(members.completed, relative_residuals(members.table), np.nan)
    residual = MemberQuantity("residual", Axis(f"max |r| / {ENERGY_SCALE}"), residuals)
    quantities = [q for q in (*main_quantities(members), residual) if np.isfinite(q.values).any()]
    if not quantities:
        return "No member completed, so there are no values to show."
    slices = conditions_of(members).slices
    rows: list[tuple[Entry, ...]] = []
    for quantity in quantities:
        for part in slices:
            values = quantity.ranked[part.chosen]
            numbers = quantiles_of(values, (*QUANTILES.values(),))
            count = int(np.count_nonzero(~np.isnan(values)))
            rows.append((quantity.axis.text, part.title, *numbers, count))
    note = " ".join([NOTE, *(q.note for q in quantities if q.note)])
    heads, title = ("quantity", "condition", *QUANTILES, "members"), "Quantiles over the members"
    return Table.of(f"{name}-quantiles", title, heads, rows, note)
