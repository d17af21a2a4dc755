"""Sections and pictures of docs/gallery.md: each config of the paper and of the examples.

`make figures` runs this script. With names of configs as arguments it makes only their pictures;
with `-` it makes none, and writes the sections alone.
"""

import re
import sys
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from PIL import Image

import rbstab
from rbstab.experiment.summary import lyapunov_function_of
from rbstab.mechanics.attitude import rotation

mpl.use("Agg")
from matplotlib import pyplot as plt

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "gallery.md"
PICTURES = PAGE.parent / "pictures" / "gallery"
SHOWN_CONFIGS = {
    "paper": "paper/*.yaml",
    "examples": "examples/*.yaml",
    "stability": "examples/stability/*.yaml",
    "sliding": "examples/sliding/*_2000.yaml",
}
"""The configs of each part of the page, in `configs`."""

COLOURS = ("#0072b2", "#d55e00", "#009e73")
SENTENCES = 2
"""Sentences of a config's comment that the page shows."""
STILLS, SHOWN = 6, 0.6
"""Number of stills of the body, and the fraction of the motion's way to rest that they show."""
SMALLEST_ANGLE = 0.1
"""Half of the least range of the axis of angles, rad: rounding errors of zero are not enlarged."""


def configs(part: str) -> list[Path]:
    """Return the configs of a part of the page."""
    return sorted((ROOT / "configs").glob(SHOWN_CONFIGS[part]))


def section(path: Path) -> str:
    """Return the section of a config: its title, its picture, its first sentences, its file."""
    text = path.read_text(encoding="utf-8")
    (title,) = re.findall(r"^title: (.*)$", text, flags=re.MULTILINE)
    words = " ".join(line.lstrip("# ") for line in text.split("\n") if line.startswith("#"))
    # The option stands beside the file.
    words = re.sub(r" It runs code, so it needs the option --allow-python:.*$", "", words)
    words = " ".join(re.split(r"(?<=[.:]) (?=[A-Z])", words)[:SENTENCES])
    words = re.sub(r" ?\(docs/(\w+)\.md\)", r" ([more](\1.md))", words)
    inside = path.relative_to(ROOT).as_posix()
    allowed = ", with `--allow-python`" if "kind: python" in text else ""
    return f"""### {title}

![Motion of {path.stem}](pictures/gallery/{path.stem}.png)

{words} [{path.name}](../{inside}){allowed}
"""


def filled(page: str) -> str:
    """Return the page with its sections written anew."""
    return re.sub(
        r"(<!-- configs of (\w+) -->\n).*?(<!-- end -->)",
        lambda match: "\n".join([match[1], *map(section, configs(match[2])), match[3]]),
        page,
        flags=re.DOTALL,
    )


def stills(axes: Any, result: rbstab.Result, config: Any) -> None:
    """Draw the way from the contact point to the centre of gravity, and beyond, at some times."""
    v = lyapunov_function_of(result)
    moving = np.flatnonzero(v > 1e-3 * v[0])
    last = int(SHOWN * moving[-1]) if len(moving) else len(v) - 1
    R = np.array(config.body.contact_point)
    length = max(float(np.linalg.norm(R)), 0.1)
    for number, n in enumerate(np.linspace(0, max(last, 1), STILLS).astype(int)):
        shade = 0.25 + 0.75 * number / (STILLS - 1)
        A, X = rotation(result["orientation"][n]), result["position"][n]
        foot, head = X + A @ R, X - A @ R
        line = np.array([foot, head])
        axes.plot(
            line[:, 0], line[:, 2], color=COLOURS[0], alpha=shade, lw=4, solid_capstyle="round"
        )
        axes.plot(*foot[[0, 2]], "o", color=COLOURS[1], alpha=shade, ms=4)
    axes.set(xlabel="axis 1 [m]", ylabel="axis 3 [m]", title="stills, from pale to dark")
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.15 * length)


def picture(path: Path) -> plt.Figure:
    """Return the picture of a config: stills, angles, energy."""
    # The elements of users among them are ours.
    config = rbstab.load_config(path, allow_python=True)
    result = rbstab.simulate(config)
    t = result["time"]
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(9, 2.6), layout="constrained")
    stills(left, result, config)
    for axis in range(3):
        middle.plot(t, result["orientation"][:, axis], color=COLOURS[axis], label=f"θ{axis + 1}")
    if np.abs(result["orientation"]).max() < SMALLEST_ANGLE:
        middle.set_ylim(-SMALLEST_ANGLE, SMALLEST_ANGLE)
    middle.set(xlabel="t [s]", title="angles [rad]")
    middle.legend(frameon=False, ncols=3, fontsize=8, loc="best", handlelength=1)
    # On s = F + κE a result stores v - ε, which does not end at zero.
    v = lyapunov_function_of(result)
    v = np.maximum(v, 1e-12 * v[0])
    right.semilogy(t, v, color=COLOURS[0])
    right.set(xlabel="t [s]", title="energy above rest, v [J]")
    for axes in (left, middle, right):
        axes.grid(visible=True, color="#e0e0e0", lw=0.6)
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def save(figure: plt.Figure, name: str) -> None:
    """Save a figure with 64 colours, which keeps the file small."""
    whole = PICTURES / f"{name}.png"
    figure.savefig(whole, dpi=100)
    plt.close(figure)
    Image.open(whole).convert("RGB").quantize(64).save(whole, optimize=True)


def main(names: list[str]) -> None:
    """Write the sections, and make the pictures."""
    PAGE.write_text(filled(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    PICTURES.mkdir(exist_ok=True)
    plt.rcParams.update({"font.size": 9, "axes.titlesize": 9, "axes.labelsize": 9})
    for path in [path for part in SHOWN_CONFIGS for path in configs(part)]:
        if not names or path.stem in names:
            save(picture(path), path.stem)


if __name__ == "__main__":
    main(sys.argv[1:])
