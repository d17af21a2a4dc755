"""Figures and tables of docs/sliding.md, from runs of the examples.

`make figures` runs this script. The numbers on the page are copied from its output.
"""

from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from statistics import median

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image
from sliding_runs import (
    BALL_STEPS,
    BOUNDS,
    CHATTER_END,
    STARTS,
    STEPS,
    at,
    ball_time,
    chattering,
    neighbours,
    predicted_rates,
    run,
    span,
    stepped,
    stepped_ball,
    sticking_at,
    stuck_from,
)
from sliding_tables import TABLES, markdown

import rbstab

HERE = Path(__file__).parent

BLUE, ORANGE, GREEN, PURPLE, GREY = "#0072B2", "#D55E00", "#009E73", "#AA4499", "#666666"
"""Colours that every kind of colour vision can distinguish (Okabe and Ito; Tol)."""

STYLE = {
    "figure.facecolor": "white",
    "figure.constrained_layout.use": True,
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "lines.linewidth": 1.4,
    "legend.frameon": True,
    "legend.framealpha": 0.9,
    "savefig.dpi": 150,
}


def bounce() -> Figure:
    """Draw E and F of one axis on both surfaces, under the same force."""
    figure, panels = new_figure(2, 2, (7.2, 4.2), sharex=True, sharey="row")
    names = {"position_exact_20000": "s = E (eq. 39)", "slope_exact_20000": "s = F + 20 E"}
    for column, (name, title) in enumerate(names.items()):
        result = run(name, *span(0.2, 2001))
        t = 1e3 * result["time"]
        upper, lower = panels[:, column]
        upper.plot(t, 1e3 * result["contact_displacement"][:, 1], color=(BLUE, ORANGE)[column])
        lower.plot(t, result["contact_velocity"][:, 1], color=(BLUE, ORANGE)[column])
        bounces = int(result["switch_count"][-1, 1])
        what = f"{bounces} crossings, no end" if column == 0 else "one crossing, then it slides"
        upper.set_title(f"{title}: {what}")
        lower.set_xlabel("t (ms)")
    panels[0, 0].set_ylabel("E₂ (mm)")
    panels[1, 0].set_ylabel("F₂ (m/s)")
    return figure


def decay() -> Figure:
    """Draw chatter energy and switches of eq. 39 for several starts, with predicted slopes."""
    figure, (left, right) = new_figure(1, 2, (7.2, 3.3))
    for number, start in enumerate(STARTS):
        result = chattering(2000, start)
        t, count = result["time"], result["switch_count"]
        labelled = number == 0
        left.semilogy(t, result["chatter_energy"], color=BLUE, label="e" if labelled else None)
        pairs = (("axes 1 and 2", count[:, :2].sum(axis=1), BLUE), ("axis 3", count[:, 2], ORANGE))
        for label, values, colour in pairs:
            positive = values > 0
            label_once = label if labelled else None
            right.semilogy(
                t[positive], values[positive], color=colour, label=label_once, linewidth=0.9
            )
    first, rate = chattering(2000), predicted_rates()
    t, e, slow = first["time"], first["chatter_energy"], first["switch_count"][:, 2]
    guide(left, rate["e"][0], 0.9, 1.5 * at(t, e, 0.9), "exp(-2d₃t/3)")
    guide(right, rate["switches, axis 3"][0], 0.9, 0.6 * at(t, slow, 0.9), "exp(d₃t/3)")
    left.set(xlabel="t (s)", ylabel="chatter energy e (J)", title="The energy decays...")
    right.set(xlabel="t (s)", ylabel="switches so far", title="...and the switches multiply")
    for panel in (left, right):
        mark_trust(panel, first)
        panel.legend()
    return figure


def guide(panel: Axes, rate: float, begin: float, start: float, text: str) -> None:
    """Draw a dashed line that grows or decays at a given rate, to the end of the runs."""
    t = np.array([begin, CHATTER_END])
    panel.semilogy(t, start * np.exp(rate * (t - begin)), "--", color=GREY, label=text, zorder=3)


def mark_trust(panel: Axes, result: rbstab.Result) -> None:
    """Shade the time after `trusted_until`, when a run is not reproducible."""
    end = float(result["trusted_until"])
    panel.axvspan(end, result["time"][-1], color="#f1efe9", zorder=0)
    panel.axvline(end, color="black", linewidth=0.9, linestyle=":")
    panel.annotate(
        "trusted_until", (end, 0.02), (3, 0), ("data", "axes fraction"), "offset points", fontsize=8
    )


def trust() -> Figure:
    """Draw two runs whose starts differ in one last digit, and their difference."""
    first, second = neighbours()
    figure, panels = new_figure(1, 3, (9.2, 3.1), width_ratios=(1.15, 1, 1))
    left, middle, right = panels
    t = first["time"]
    for name, label, colour in (
        ("contact_velocity", "F (m/s)", BLUE),
        ("orientation", "Θ (rad)", ORANGE),
    ):
        apart = np.abs(first[name] - second[name]).max(axis=1)
        left.semilogy(t[apart > 0], apart[apart > 0], color=colour, label=label)
    left.set(ylabel="difference of the two runs", title="One last digit grows to everything")
    left.legend(loc="center right")
    for result, line, label in ((first, "-", "Ω₁(0) = 16"), (second, "--", "16.000000000000004")):
        colour = BLUE if line == "-" else ORANGE
        used = (t >= 0.19) & (t <= 0.31)
        F = result["contact_velocity"][used, 1]
        middle.plot(t[used], F, line, color=colour, label=label, linewidth=1.1)
        right.plot(t, result["orientation"], line, color=colour, linewidth=1.8)
    middle.set(ylabel="F₂ (m/s)", title="The bounces come apart", ylim=(-4.5, 6.5))
    middle.legend(loc="upper right", fontsize=7.5)
    right.set(ylabel="Θ₁, Θ₂, Θ₃ (rad)", title="The slow motion does not")
    for panel in panels:
        panel.set_xlabel("t (s)")
        mark_trust(panel, first)
    middle.set_xlim(0.19, 0.31)
    return figure


def sticking() -> Figure:
    """Draw the time of sticking against the implicit step; the step decides it only on s = E."""
    figure, panel = new_figure(1, 1, (6.4, 3.9))
    steps = np.array([float(step) for step in STEPS])
    panel.loglog(steps, ball_time(steps), "--", color=GREY, label="x/(hk), predicted")
    ball = [stuck_from(stepped_ball(step)) for step in BALL_STEPS]
    panel.loglog(
        steps[: len(ball)], ball, "s", color=GREY, markersize=4, label="ball in a V, x = 0.2 m"
    )
    for surface, colour, label in (
        ("position", BLUE, "s = E (eq. 39)"),
        ("slope", ORANGE, "s = F + 20 E"),
    ):
        times = [stuck_from(stepped(surface, step)) for step in STEPS]
        panel.loglog(steps, times, "o-", color=colour, label=label)
    for bound in (BOUNDS[0], BOUNDS[-1]):
        stuck = median(stuck_from(result) for result in sticking_at(bound))
        panel.axhline(stuck, color=GREEN, linewidth=1, linestyle=":")
        text = f"exact, sticking below {bound} J"
        panel.text(
            1.3e-3, stuck, text, va="center", fontsize=8, backgroundcolor="white", color=GREEN
        )
    panel.set(xlabel="implicit step h (s)", ylabel="stuck from (s)", xlim=(8e-6, 1.2e-2))
    panel.set_title("On s = E the step decides when the chatter ends; on s = F + 20 E it does not")
    panel.legend(fontsize=8)
    return figure


LAWS = {
    "exact": ("exact", BLUE, "-"),
    "layer": ("boundary layer", ORANGE, "-"),
    "implicit": ("implicit, h = 0.1 ms", GREEN, "--"),
}


def laws() -> Figure:
    """Draw the distance of the contact point under every law, on both surfaces."""
    figure, panels = new_figure(1, 2, (7.8, 3.5), sharey=True)
    for panel, surface in zip(panels, ("position", "slope"), strict=True):
        for law, (label, colour, line) in LAWS.items():
            # In the layer of s = E the point oscillates at 100 to 250 Hz.
            fine = span(1.4, 2801) if (surface, law) == ("position", "layer") else ()
            result = run(f"{surface}_{law}_20000", *fine)
            distance = np.linalg.norm(result["contact_displacement"], axis=1)
            width = {"exact": 2.6, "layer": 0.9}.get(law, 1.5)
            floor = np.maximum(distance, 1e-14)
            panel.semilogy(result["time"], floor, line, color=colour, label=label, linewidth=width)
        panel.set(xlabel="t (s)", ylim=(1e-13, 1), xlim=(0, 1.4))
        panel.legend(loc="lower right" if surface == "position" else "lower left", fontsize=8)
    panels[0].set(ylabel="|E| (m)", title="s = E (eq. 39); exact: sticks below 10 J")
    panels[1].set(title="s = F + 20 E")
    return figure


FIGURES: dict[str, Callable[[], Figure]] = {
    "bounce": bounce,
    "decay": decay,
    "trust": trust,
    "sticking": sticking,
    "laws": laws,
}


def new_figure(rows: int, columns: int, size: tuple[float, float], **options: object) -> tuple:
    """Return a new figure in the style of the page, and its panels."""
    figure = Figure(figsize=size)
    return figure, figure.subplots(rows, columns, **options)


def save(figure: Figure, path: Path) -> None:
    """Write a PNG of 64 colours, a third of the size of the full one."""
    drawn = BytesIO()
    figure.savefig(drawn)
    Image.open(drawn).convert("RGB").quantize(64).save(path, optimize=True)


def main() -> None:
    """Draw every figure into the folder of this file, and print the tables."""
    with mpl.rc_context(STYLE):
        for name, draw in FIGURES.items():
            save(draw(), HERE / f"sliding_{name}.png")
    for table in TABLES:
        print(markdown(table()))


if __name__ == "__main__":
    main()
