"""The figure of docs/inputs.md: the kinds of signals, and v of the example with its supply.

`make figures` runs this script.
"""

from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from PIL import Image

import rbstab
from rbstab.config.build import problem_of

HERE = Path(__file__).parent
EXAMPLE = HERE.parents[1] / "configs" / "examples" / "driven.yaml"

COLOURS = ("#0072B2", "#D55E00", "#009E73")
"""Colours that every kind of colour vision can distinguish (Okabe and Ito)."""

STYLE = {"figure.facecolor": "white", "figure.constrained_layout.use": True, "font.size": 9}

SIGNALS: dict[str, dict[str, Any]] = {
    "constant": {"kind": "constant"},
    "sine": {"kind": "sine", "frequency": 1.0, "phase": 0.0},
    "pulse": {"kind": "pulse", "start": 0.5, "duration": 0.6},
    "ramp": {"kind": "ramp", "start": 0.5, "duration": 1.0},
    "table": {"kind": "table", "times": [0.2, 0.7, 1.2, 1.2, 1.8], "values": [0, 1, 0.3, -0.6, 0]},
    "noise": {"kind": "noise", "seed": 1, "rate": 20.0, "correlation_time": 0.2},
}


def signal_values(signal: dict[str, Any], times: np.ndarray) -> np.ndarray:
    """Return a signal at some times, as the equations have it."""
    element = {
        "kind": "input",
        "quantity": "couple",
        "direction": [1, 0, 0],
        "amplitude": 1,
        "signal": signal,
    }
    data = {
        "schema_version": 2,
        "body": {"mass": 1, "inertia": [1, 1, 1], "contact_point": [0, 0, 0]},
        "elements": {"one": element},
        "integration": {"duration": float(times[-1])},
    }
    problem = problem_of(rbstab.load_config(data))

    def value(t: float) -> float:
        schedule, system = problem.schedule, problem.system
        system = system if schedule is None else schedule.system_at(system, t)
        input_element: Any = system.elements[-1]
        return float(input_element.signal.value(t))

    return np.array([value(t) for t in times.tolist()])


def figure() -> Figure:
    """Return the figure."""
    with mpl.rc_context(STYLE):
        drawn = Figure(figsize=(9.0, 3.6))
        left, right = drawn.subfigures(1, 2, width_ratios=[1.1, 1])
        times = np.linspace(0.0, 2.0, 801)
        panels = left.subplots(3, 2, sharex=True).flat
        for axes, (name, signal) in zip(panels, SIGNALS.items(), strict=True):
            axes.plot(times, signal_values(signal, times), color=COLOURS[0], lw=1.2)
            axes.set_title(name, fontsize=9)
            axes.set_ylim(-2.2 if name == "noise" else -1.2, 2.2 if name == "noise" else 1.3)
            axes.grid(visible=True, lw=0.3)
        left.supxlabel("time t [s]", fontsize=9)
        run = rbstab.simulate(EXAMPLE)
        supplied = run["supplied_energy"]
        axes = right.subplots()
        curves = {
            "supplied since the start": supplied,
            "dissipated since the start": supplied - run["lyapunov_change"],
            "v": run["lyapunov"],
        }
        for colour, (name, values) in zip(COLOURS, curves.items(), strict=True):
            axes.plot(run["time"], values, label=name, color=colour, lw=1.2)
        axes.set(xlabel="time t [s]", ylabel="energy [J]", title="driven.yaml")
        axes.grid(visible=True, lw=0.3)
        axes.legend(frameon=False)
        return drawn


def main() -> None:
    """Make the figure."""
    buffer = BytesIO()
    figure().savefig(buffer, dpi=130)
    image = Image.open(buffer).convert("RGB").quantize(64)
    image.save(HERE / "inputs.png", optimize=True)


if __name__ == "__main__":
    main()
