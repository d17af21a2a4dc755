"""Tables of docs/sliding.md, as `make figures` prints them."""

from collections.abc import Callable, Iterator
from statistics import median

import numpy as np
from sliding_runs import (
    BALL_STEPS,
    BOUNDS,
    PERMANENT,
    PERMANENT_OPTIONS,
    STARTS,
    STEPS,
    at,
    ball_time,
    chattering,
    error_growth,
    measured_rates,
    neighbours,
    predicted_rates,
    run,
    span,
    stepped,
    stepped_ball,
    sticking_at,
    stuck_from,
)

import rbstab

Table = list[tuple[str, ...]]
"""Rows of cells; the first row is the heading."""

WORDS = {
    "E": "contact_displacement",
    "F": "contact_velocity",
    "Θ": "orientation",
    "e": "chatter_energy",
}
"""Names of the arrays of a result by their symbols."""


def switch_table() -> Table:
    """Return the switches so far on s = E; after `trusted_until` as a range over the starts."""
    table = [("t (s)", "K_s = 2000 N", "K_s = 20000 N")]
    for time in (0.2, 0.6, 1.0, 1.4):
        cells = []
        for K_s in (2000, 20000):
            runs = [chattering(K_s, start) for start in STARTS]
            counts = [int(at(r["time"], r["switch_count"].sum(axis=1), time)) for r in runs]
            trusted = time <= runs[0]["trusted_until"]
            cells.append(f"{counts[0]}" if trusted else f"~ {min(counts)} to {max(counts)}")
        table.append((f"{time:g}", *cells))
    return table


def rate_table() -> Table:
    """Return the rates of the chatter, as ranges over the starts."""
    table = [("growth of", "predicted", "measured")]
    measured = zip(*(measured_rates(chattering(2000, start)) for start in STARTS), strict=True)
    for (name, (low, high)), rates in zip(predicted_rates().items(), measured, strict=True):
        predicted = f"{low:.2f}" if low == high else f"{low:.2f} to {high:.2f}"
        seen = f"~ {min(rates, key=abs):.2f} to {max(rates, key=abs):.2f}"
        table.append((f"{name} (1/s)", predicted, seen))
    return [*table, ("an error (per switch)", "-", f"{error_growth():.2f}")]


def event_table() -> Table:
    """Return every crossing, stick and release on s = F + 20 E."""
    table = [("K_s (N)", "t (s)", "axis", "what")]
    for K_s in (20000, 2000):
        result = run(f"slope_exact_{K_s}", "integration.engine=heyoka", *span(0.2, 41))
        events = list(_columns(result, "transition_time", "transition_axis", "transition_kind"))
        transitions = {event[:2] for event in events}
        crossings = [
            e for e in _columns(result, "switch_time", "switch_axis") if e not in transitions
        ]
        events = sorted(events + [(*crossing, "cross") for crossing in crossings])
        table += [(str(K_s), f"{t:.10f}", str(axis), what) for t, axis, what in events]
    return table


def _columns(result: rbstab.Result, *names: str) -> Iterator[tuple]:
    return zip(*(result[name].tolist() for name in names), strict=True)


def trust_table() -> Table:
    """Return the differences of two runs whose starts differ in one last digit, K_s = 20000 N."""
    first, second = neighbours()
    trusted = first["time"] <= first["trusted_until"]
    table = [("largest difference", "up to trusted_until", "up to 0.6 s", "largest value")]
    for name, unit in (("F", "m/s"), ("E", "m"), ("Θ", "rad"), ("e", "J")):
        array = WORDS[name]
        apart, largest = np.abs(first[array] - second[array]), np.abs(first[array]).max()
        cells = f"{apart[trusted].max():.0e}", f"{float(f'{apart.max():.1g}'):g}", f"{largest:.4g}"
        table.append((f"{name} ({unit})", *cells))
    return table


def holding_table() -> Table:
    """Return the force that holds the point, which a sliding connector must be able to exert."""
    held = rbstab.simulate(rbstab.load_config(PERMANENT, [*PERMANENT_OPTIONS]))
    force = np.abs(held["contact_force"]).max(axis=1)
    later = held["time"][np.flatnonzero(force > 2000)[-1] + 1]
    return [
        ("the point held from the start", "value"),
        ("largest component of Λ (N)", f"{force.max():.0f}"),
        ("below 2000 N from (s)", f"{later:.3f}"),
    ]


def work_table() -> Table:
    """Return v - ε and the work ε of Λ on s = F + 20 E; ε rises and falls."""
    result = run("slope_exact_20000")
    power = (result["contact_velocity"] * result["contact_force"]).sum(axis=1)
    work, v, r = (result[name] for name in ("contact_work", "lyapunov", "energy_residual"))
    return [
        ("quantity", "value"),
        ("v - ε at the start (J)", f"{v[0]:.1f}"),
        ("v - ε at 2 s (J)", f"{v[-1]:.1f}"),
        ("ε at 2 s (J)", f"{work[-1]:.1f}"),
        ("least ε (J)", f"{work.min():.1f}"),
        ("largest power F'Λ (W)", f"{power.max():.0f}"),
        ("largest energy_residual (J)", f"{np.abs(r).max():.0e}"),
    ]


def sticking_table() -> Table:
    """Return the times, energy losses and final states of sticking on s = E."""
    table = [
        (
            *("stick_energy (J)", "stuck from (s)", "median (s)"),
            *("discarded_energy (J)", "median of Θ(2) (10⁻³ rad)"),
        )
    ]
    ends = []
    for bound in BOUNDS:
        runs = sticking_at(bound)
        times = [stuck_from(result) for result in runs]
        discarded = median(result["discarded_energy"][-1] for result in runs)
        ends.append([result["orientation"][-1] for result in runs])
        cells = f"{min(times):.2f} to {max(times):.2f}", f"{median(times):.2f}", f"{discarded:.3g}"
        row = (*cells, in_thousandths(np.median(ends[-1], axis=0)))
        table.append((f"{bound}", *(f"~ {cell}" for cell in row)))
    for what, axis in (("bounds, same start", 0), ("starts, same bound", 1)):
        apart = 1e3 * np.ptp(ends, axis=axis).max()
        table.append((f"largest difference between {what}", *"---", f"~ {apart:.2f}"))
    return table


def in_thousandths(vector: np.ndarray) -> str:
    """Return three numbers times 1000, as text."""
    return "(" + ", ".join(f"{1e3 * x:.3f}" for x in vector) + ")"


def implicit_table(steps: tuple[str, ...] = STEPS) -> Table:
    """Return the time, s, at which implicit steps make all axes stick, for each step."""
    table = [
        (
            *("h (s)", "s = E", "discarded_energy (J)", "trusted_until (s)"),
            *("s = F + 20 E", "ball", "x/(hk)"),
        )
    ]
    for step in steps:
        on_E, on_slope = stepped("position", step), stepped("slope", step)
        ball = ("-", "-")
        if step in BALL_STEPS:
            ball = f"{stuck_from(stepped_ball(step)):.3f}", f"{ball_time(float(step)):.3f}"
        discarded = f"{on_E['discarded_energy'][-1]:.0f}"
        trusted = f"{float(on_E['trusted_until']):.3g}"
        times = f"{stuck_from(on_E):.4f}", discarded, trusted, f"{stuck_from(on_slope):.5f}"
        table.append((step, *times, *ball))
    return table


def law_table() -> Table:
    """Return the results of every law side by side, K_s = 20000 N."""
    table = [
        (
            "surface",
            "law",
            "held from (s)",
            "\\|E\\| at 1 s (m)",
            "trusted_until (s)",
            "Θ(2) (10⁻³ rad)",
        )
    ]
    for surface, title in (("position", "s = E"), ("slope", "s = F + 20 E")):
        for law in ("exact", "layer", "implicit"):
            result = run(f"{surface}_{law}_20000")
            held = "never" if law == "layer" else f"{stuck_from(result):.4f}"
            distance = at(result["time"], np.linalg.norm(result["contact_displacement"], axis=1), 1)
            cells = (
                held,
                f"{distance:.1e}" if distance > 1e-15 else "0",
                f"{float(result['trusted_until']):.3g}",
            )
            table.append((title, law, *cells, in_thousandths(result["orientation"][-1])))
    return table


TABLES: tuple[Callable[[], Table], ...] = (
    switch_table,
    rate_table,
    trust_table,
    holding_table,
    event_table,
    work_table,
    sticking_table,
    implicit_table,
    law_table,
)


def markdown(table: Table) -> str:
    """Return a table in the Markdown of the page."""
    heading, *rows = ["| " + " | ".join(cells) + " |" for cells in table]
    return "\n".join([heading, "|" + "---|" * len(table[0]), *rows, ""])
