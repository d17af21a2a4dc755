"""Eigenvalues at the rest state in the complex plane, and how they move with the gain K_r."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbstab.config.errors import ConfigError
from rbstab.experiment.locus import root_locus
from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Block
from rbstab.report.model.figure import Axis, Figure, Level, Line, Mark, Panel, Points
from rbstab.report.model.palette import COLOURS
from rbstab.report.reading.sources import Run

GAIN = "controller.K_r"
"""The gain that every variant has."""

FACTORS = np.geomspace(0.1, 10.0, 41)

NOMINAL = len(FACTORS) // 2

MAX_LOCI = 6
"""Each costs 41 rest states and linearisations."""

SLOW = 10.0
"""Times the slowest decay: what decays faster is not drawn among the slow ones."""

PANELS = {False: "all eigenvalues", True: "the slow ones"}
"""Whether only those are drawn that decay slowly."""

REAL, IMAGINARY = Axis("real part Re λ", "1/s"), Axis("imaginary part Im λ", "1/s")

BORDER = Level(0.0, "border of stability", upright=True)


class Roots(NamedTuple):
    """The eigenvalues of a run: factors on K_r, shape (n,); values, complex, shape (n, k), 1/s."""

    run: Run
    factors: Array
    values: Array


def eigenvalue_blocks(runs: Sequence[Run]) -> tuple[Block, ...]:
    """Figures of the eigenvalues of runs, and sentences where there are none."""
    readable = [run for run in runs if run.config is not None]
    only_nominal = [_roots(run, FACTORS[NOMINAL : NOMINAL + 1]) for run in readable[MAX_LOCI:]]
    swept = [_roots(run, FACTORS) for run in readable[:MAX_LOCI]]
    loci = [roots for roots in swept if roots is not None]
    found = [*loci, *(roots for roots in only_nominal if roots is not None)]
    blocks: list[Block] = []
    if found:
        blocks.append(_spectra([_nominal(roots) for roots in found]))
    blocks += [_locus(roots) for roots in loci]
    blocks += _sentences(runs, readable, [roots.run for roots in found])
    return tuple(blocks)


def _roots(run: Run, factors: Array) -> Roots | None:
    """The eigenvalues of a run for the factors that have a rest state; None if there are none."""
    assert run.config is not None
    try:
        with np.errstate(all="ignore"):
            points = root_locus(run.config, GAIN, factors)
    # A report shows what there is: near the end of the range of numbers there are none.
    except (ArithmeticError, ValueError, KeyError, ConfigError, np.linalg.LinAlgError):
        return None
    made = [(p.factor, p.linearisation.eigenvalues) for p in points if p.linearisation is not None]
    if not made:
        return None
    return Roots(run, np.array([factor for factor, _ in made]), np.array([v for _, v in made]))


def _nominal(roots: Roots) -> Roots:
    nearest = int(np.abs(np.log(roots.factors)).argmin())
    return Roots(roots.run, roots.factors[[nearest]], roots.values[[nearest]])


def _spectra(each: list[Roots]) -> Figure:
    panels = tuple(
        Panel(REAL, IMAGINARY, (*_crosses(each, slow=slow), BORDER), title=title)
        for slow, title in PANELS.items()
    )
    return Figure(
        "runs-eigenvalues",
        "Eigenvalues at the rest state",
        panels,
        columns=2,
        caption="Of the motion linearised at the rest state. The slow ones decay at most "
        f"{SLOW:g} times as fast as the slowest.",
    )


def _crosses(each: list[Roots], *, slow: bool) -> list[Mark]:
    marks: list[Mark] = []
    for run, _, values in each:
        eigenvalues = values[0]
        if slow:
            eigenvalues = eigenvalues[_slow(eigenvalues, eigenvalues)]
        marks.append(
            Points(
                eigenvalues.real,
                eigenvalues.imag,
                run.label,
                colour=run.number,
                symbol=(1, 2, 3)[run.number // len(COLOURS) % 3],
                texts=tuple(_described(value) for value in eigenvalues.tolist()),
            )
        )
    return marks


def _slow(values: Array, nominal: Array) -> NDArray[np.bool_]:
    """Which eigenvalues decay at most `SLOW` times as fast as the slowest nominal one."""
    slowest = -float(nominal.real.max())
    # Where one grows or stays there is no slowest decay to be compared with.
    bound = SLOW * slowest if slowest > 0 else np.inf
    return np.asarray(-values.real <= bound)


def _described(value: complex) -> str:
    damping = -value.real / abs(value) if value else float("nan")
    return f"λ = {value.real:.5g} {value.imag:+.5g}i 1/s, ζ = {damping:.4g}"


def _locus(roots: Roots) -> Figure:
    run, factors, _ = roots
    panels = tuple(
        Panel(REAL, IMAGINARY, (*_branches(roots, slow=slow), BORDER), title=title)
        for slow, title in PANELS.items()
    )
    return Figure(
        f"{run.name}-locus",
        f"Root locus along K_r: {run.label}",
        panels,
        columns=2,
        caption=f"K_r is multiplied as a whole, by {len(factors)} factors; each point is taken at "
        "its own rest state. A curve has a gap where a pair leaves the real axis or meets it.",
    )


def _branches(roots: Roots, *, slow: bool) -> list[Mark]:
    _, factors, values = roots
    as_it_is = int(np.abs(np.log(factors)).argmin())
    if slow:
        values = np.where(_slow(values, values[as_it_is]), values, complex(np.nan, np.nan))
    lowest, highest = f"K_r times {factors[0]:g}", f"K_r times {factors[-1]:g}"
    marks: list[Mark] = [
        Line(x, y, "in between") for x, y in (_with_gaps(branch) for branch in values.T)
    ]
    for index, label, colour, symbol in (
        (0, lowest, 2, 2),
        (as_it_is, "K_r as it is", 1, 1),
        (-1, highest, 3, 3),
    ):
        found = values[index]
        marks.append(Points(found.real, found.imag, label, colour=colour, symbol=symbol))
    return marks


def _with_gaps(branch: Array) -> tuple[Array, Array]:
    """A branch as x and y, without straight lines between a real and a complex eigenvalue."""
    real = branch.imag == 0
    leaves = np.flatnonzero(real[1:] != real[:-1]) + 1
    return np.insert(branch.real, leaves, np.nan), np.insert(branch.imag, leaves, np.nan)


def _sentences(runs: Sequence[Run], readable: list[Run], found: list[Run]) -> list[Block]:
    said: list[Block] = []
    unreadable = [run.label for run in runs if run.config is None]
    restless = [run.label for run in readable if run not in found]
    if unreadable:
        said.append(
            "No eigenvalues are drawn of runs whose config this version cannot read: "
            f"{', '.join(unreadable)}."
        )
    if restless:
        said.append(
            "No eigenvalues are drawn of runs without a rest state in the range of eq. 5: "
            f"{', '.join(restless)}."
        )
    if len(readable) > MAX_LOCI:
        said.append(f"Root loci are drawn of the first {MAX_LOCI} runs only.")
    return said
