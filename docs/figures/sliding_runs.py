"""The runs behind docs/sliding.md, and its tables: what `make figures` prints."""

from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import numpy as np

import rbstab

EXAMPLES = Path(__file__).parents[2] / "configs" / "examples" / "sliding"

STEPS = ("1.0e-3", "5.0e-4", "2.0e-4", "1.0e-4", "5.0e-5", "2.0e-5", "1.0e-5")
"""Steps of the implicit law, s, as they stand on the page."""

BALL_STEPS = STEPS[:4]
"""Those that the ball, which takes longest, is followed with."""

BOUNDS = (100, 10, 1)
"""Values of `stick_energy`, J."""

NEXT_TO_16 = "initial.angular_velocity=[16.000000000000004, 32, -16]"
"""The paper's start but for the last digit of one number."""

LATE = 1.6
"""s: how long the chatter is followed; a second more has a million times as many switches."""

BALL = {"mass": 41, "K_s": 20000, "height": 0.2}
"""kg, N, m: a body held at its centre of gravity, where it is a ball in a V on each axis."""

WORDS = {
    "E": "contact_displacement",
    "F": "contact_velocity",
    "Θ": "orientation",
    "e": "chatter_energy",
}
"""Arrays of a result by their symbols."""

Table = list[tuple[str, ...]]
"""Rows of cells, the first of them the heading."""


@cache
def run(name: str, *overrides: str) -> rbstab.Result:
    """The result of an example with some of its values replaced."""
    return rbstab.simulate(rbstab.load_config(EXAMPLES / f"{name}.yaml", list(overrides)))


def span(duration: float, samples: int) -> tuple[str, str]:
    """Overrides for the time that is simulated."""
    return f"integration.duration={duration}", f"integration.samples={samples}"


def chattering(K_s: int) -> rbstab.Result:
    """Eq. 39, followed exactly and never made to stick."""
    return run(f"position_exact_{K_s}", "controller.stick_energy=0", *span(LATE, 321))


def sticking_at(bound: int) -> rbstab.Result:
    """Eq. 39, exact, made to stick below a chatter energy."""
    return run("position_exact_20000", f"controller.stick_energy={bound}")


def stepped(surface: str, step: str) -> rbstab.Result:
    """Implicit steps, K_s = 20000 N."""
    lasts = span(1.0, 201) if surface == "position" else span(0.1, 21)
    return run(f"{surface}_implicit_20000", f"controller.law.implicit={step}", *lasts)


@cache
def stepped_ball(step: str) -> rbstab.Result:
    """Implicit steps of a ball in a V that starts at rest; nothing but the steps damps it."""
    nothing, x = [1e-9] * 3, BALL["height"]
    # Samples 10 ms apart, a whole number of steps: between others the steps would be shorter.
    intervals = round(150 * ball_time(float(step)))
    controller = {"variant": "sliding", "K_s": [BALL["K_s"]] * 3, "surface": "position"}
    controller["law"] = {"implicit": float(step)}
    end = {"duration": intervals / 100, "samples": intervals + 1}
    return rbstab.simulate(
        {
            "body": {"mass": BALL["mass"], "inertia": [1, 1, 1], "contact_point": [0, 0, 0]},
            "controller": controller | dict.fromkeys(("K_t", "L_t", "K_r", "L_r"), nothing),
            "initial": {"position": [x, x, x]},
            "integration": {**end, "engine": "heyoka"},
        }
    )


def ball_time(step: float) -> float:
    """x/(hk), s: when implicit steps make a ball stick that falls from x."""
    return BALL["height"] * BALL["mass"] / (step * BALL["K_s"])


def stuck_from(result: rbstab.Result) -> float:
    """The time of the last stick, s, after which every axis is held to the end of the run."""
    assert not result["mode"][-1].any() or result["transition_kind"][-1] == "stick"
    return float(result["transition_time"][-1])


def reflected_damping() -> np.ndarray:
    """What the stabilizers' damping is at C of the unturned body, shape (3, 3), 1/s.

    An impulse p at C gives the body p/m and J⁻¹Řp, and C the velocity F = Wp; L_t and L_r take
    p'Sp from it each second, so that Ḟ = -SW⁻¹F. Written down here once more so that the slopes
    in the figure are predictions.
    """
    m, J, R = 41.0, np.array([10.0, 8.0, 0.4]), np.array([0.15, 0.10, -0.42])
    L_t, L_r = np.diag([200.0, 200.0, 140.0]), np.diag([60.0, 60.0, 42.0])
    cross = np.cross(R, np.eye(3)).T
    turning = cross / J[:, None]
    W = np.eye(3) / m + cross.T @ turning
    return (L_t / m**2 + turning.T @ L_r @ turning) @ np.linalg.inv(W)


def growth(times: np.ndarray, values: np.ndarray, begin: float, end: float) -> float:
    """The rate of growth of a positive quantity between two times, 1/s, by least squares."""
    used = (times >= begin) & (times <= end) & (values > 0)
    return float(np.polyfit(times[used], np.log(values[used]), 1)[0])


def rates(result: rbstab.Result) -> dict[str, tuple[float, float]]:
    """Predicted and measured rates of the late chatter, 1/s."""
    d = np.diag(reflected_damping())
    t, count = result["time"][:-1], np.diff(result["switch_count"], axis=0)
    # Crossings in a tenth of a second: in a single sample axis 3 has one or none.
    wide = np.add.reduceat(count, np.arange(0, len(count), 20))
    return {
        "e": (-2 * d[2] / 3, growth(result["time"], result["chatter_energy"], 1.0, LATE)),
        "switches, axis 3": (d[2] / 3, growth(t[::20], wide[:, 2], 0.8, LATE)),
        "switches, axes 1 and 2": (
            d[:2].mean() / 3,
            growth(t[::20], wide[:, :2].sum(1), 1.3, LATE),
        ),
    }


def switch_table() -> Table:
    """Switches so far on s = E; those beyond `trusted_until` are marked."""
    table = [("t (s)", "K_s = 2000 N", "K_s = 20000 N")]
    both = [chattering(K_s) for K_s in (2000, 20000)]
    for time in (0.2, 0.6, 1.0, 1.4):
        cells = []
        for result in both:
            count = int(at(result["time"], result["switch_count"].sum(axis=1), time))
            cells.append(f"{'' if time <= result['trusted_until'] else '~ '}{count}")
        table.append((f"{time:g}", *cells))
    return table


def rate_table() -> Table:
    """The rates of the chatter."""
    found = [(name, f"{a:.2f}", f"{b:.2f}") for name, (a, b) in rates(chattering(2000)).items()]
    error = ("an error, each switch", "0.15", f"{error_growth():.2f}")
    return [("growth of", "predicted", "measured"), *found, error]


def event_table() -> Table:
    """Every crossing, stick and release on s = F + 20 E."""
    table = [("K_s (N)", "t (s)", "axis", "what")]
    for K_s in (20000, 2000):
        result = run(f"slope_exact_{K_s}", *span(0.4, 401))
        events = list(_columns(result, "transition_time", "transition_axis", "transition_kind"))
        known = {event[:2] for event in events}
        crossings = [e for e in _columns(result, "switch_time", "switch_axis") if e not in known]
        events = sorted(events + [(*crossing, "cross") for crossing in crossings])
        table += [(str(K_s), f"{t:.10f}", str(axis), what) for t, axis, what in events]
    return table


def _columns(result: rbstab.Result, *names: str) -> Iterator[tuple]:
    return zip(*(result[name].tolist() for name in names), strict=True)


def trust_table() -> Table:
    """How far two starts come apart that differ in one last digit, K_s = 20000 N."""
    one, other = neighbours()
    trusted = one["time"] <= one["trusted_until"]
    table = [("largest difference", "up to trusted_until", "up to 0.6 s", "largest value")]
    for name, unit in (("F", "m/s"), ("E", "m"), ("Θ", "rad"), ("e", "J")):
        array = WORDS[name]
        apart, largest = np.abs(one[array] - other[array]), np.abs(one[array]).max()
        cells = f"{apart[trusted].max():.0e}", f"{apart.max():.1g}", f"{largest:.3g}"
        table.append((f"{name} ({unit})", *cells))
    return table


def neighbours() -> tuple[rbstab.Result, rbstab.Result]:
    """Two runs on s = E whose starts differ in one last digit, K_s = 20000 N."""
    options = ("controller.stick_energy=0", *span(0.6, 1201))
    return run("position_exact_20000", *options), run("position_exact_20000", *options, NEXT_TO_16)


def error_growth() -> float:
    """By which power of e the two come apart at each switch, by least squares."""
    one, other = neighbours()
    apart = np.abs(one["contact_velocity"] - other["contact_velocity"]).max(axis=1)
    used = (one["time"] <= one["trusted_until"]) & (apart > 0)
    count = one["switch_count"].sum(axis=1)
    return float(np.polyfit(count[used], np.log(apart[used]), 1)[0])


def work_table() -> Table:
    """v - ε on s = F + 20 E, where the work ε of Λ goes up and down."""
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
    """What sticking on s = E costs and changes."""
    table = [("stick_energy (J)", "stuck from (s)", "discarded_energy (J)", "Θ(2) (10⁻³ rad)")]
    table += [(f"{bound}", *_ending(sticking_at(bound))) for bound in BOUNDS]
    neighbour = run("position_exact_20000", NEXT_TO_16)
    return [*table, ("10, Ω₁(0) = 16.000000000000004", *_ending(neighbour))]


def _ending(result: rbstab.Result) -> tuple[str, str, str]:
    discarded = f"{result['discarded_energy'][-1]:.4g}"
    return f"{stuck_from(result):.3f}", discarded, in_thousandths(result["orientation"][-1])


def in_thousandths(vector: np.ndarray) -> str:
    """Three numbers times 1000."""
    return "(" + ", ".join(f"{1e3 * x:.3f}" for x in vector) + ")"


def implicit_table(steps: tuple[str, ...] = STEPS) -> Table:
    """When implicit steps make everything stick, s, against the step."""
    table = [("h (s)", "s = E", "discarded_energy (J)", "s = F + 20 E", "ball", "x/(hk)")]
    for step in steps:
        on_E, on_slope = stepped("position", step), stepped("slope", step)
        ball = ("-", "-")
        if step in BALL_STEPS:
            ball = f"{stuck_from(stepped_ball(step)):.3f}", f"{ball_time(float(step)):.3f}"
        discarded = f"{on_E['discarded_energy'][-1]:.0f}"
        times = f"{stuck_from(on_E):.4f}", discarded, f"{stuck_from(on_slope):.5f}"
        table.append((step, *times, *ball))
    return table


def law_table() -> Table:
    """The example of every law side by side, K_s = 20000 N."""
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
            cells = held, f"{distance:.1e}", f"{float(result['trusted_until']):.3g}"
            table.append((title, law, *cells, in_thousandths(result["orientation"][-1])))
    return table


def at(times: np.ndarray, values: np.ndarray, time: float) -> float:
    """The value at a sample."""
    return float(values[np.abs(times - time).argmin()])


TABLES: tuple[Callable[[], Table], ...] = (
    switch_table,
    rate_table,
    trust_table,
    event_table,
    work_table,
    sticking_table,
    implicit_table,
    law_table,
)


def markdown(table: Table) -> str:
    """A table as it stands on the page."""
    heading, *rows = ["| " + " | ".join(cells) + " |" for cells in table]
    return "\n".join([heading, "|" + "---|" * len(table[0]), *rows, ""])
