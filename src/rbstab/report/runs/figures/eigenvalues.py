"""Figures of the eigenvalues at the rest state, and of their root loci along the gain K_r."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rbstab.analysis.linearisation import are_real, eigenvalue_text
from rbstab.config.errors import ConfigError
from rbstab.config.user_code.permission import has_code
from rbstab.experiment.locus import linearised_at_rest, root_locus
from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Block
from rbstab.report.model.figure import Axis, Figure, Level, Line, Mark, Panel, Points
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.spectra import Roots, alike, farthest, is_far

GAIN = "controller.K_r"
"""The gain that is varied; every variant has it, but a body without a controller does not."""

FACTORS = np.geomspace(0.1, 10.0, 41)
"""Factors by which the gain is multiplied."""

NOMINAL_INDEX = len(FACTORS) // 2
"""Index of the factor 1."""

MAX_LOCI = 6
"""Maximum number of root loci; each needs 41 rest states and linearisations."""

SLOW_FACTOR = 10.0
"""An eigenvalue is slow if it decays at most this many times as fast as the slowest."""

MIN_ZOOM = 1.5
"""A panel with the slow eigenvalues must show a range that is smaller by at least this factor."""

PANEL_TITLES = {False: "all eigenvalues", True: "slow eigenvalues"}
"""Titles of the panels: with all eigenvalues (False), or only the slow ones (True)."""

REAL, IMAGINARY = Axis("real part Re λ", "1/s"), Axis("imaginary part Im λ", "1/s")

SYMBOLS = (1, 2, 3, 4, 5, 6)
"""Numbers of the symbols of runs: all are open, so that equal eigenvalues of two runs are seen.
There is one less than colours, so that runs with the same symbol have other colours."""

BORDER = Level(0.0, "border of stability", vertical=True)


def eigenvalue_blocks(runs: Sequence[Run]) -> tuple[Block, ...]:
    """Return figures of the eigenvalues of runs, and sentences on missing ones."""
    # A stored result must not run code of a user, and the equations have it.
    readable = [run for run in runs if run.config is not None and not has_code(run.config)]
    only_nominal = [
        _roots(run, FACTORS[NOMINAL_INDEX : NOMINAL_INDEX + 1]) for run in readable[MAX_LOCI:]
    ]
    swept = [_roots(run, FACTORS) for run in readable[:MAX_LOCI]]
    first = [roots for roots in swept if roots is not None]
    loci = [roots for roots in first if _has_gain(roots.run)]
    drawn = [*first, *(roots for roots in only_nominal if roots is not None)]
    blocks: list[Block] = []
    if drawn:
        # Runs that are alike have the look of the first.
        coloured_first = sorted(drawn, key=lambda roots: bool(roots.run.legend))
        blocks.append(_spectra([_nominal(roots) for roots in coloured_first]))
    blocks += [_locus(roots) for roots in loci]
    blocks += _sentences(runs, readable, drawn)
    return tuple(blocks)


def _roots(run: Run, factors: Array) -> Roots | None:
    """Return the eigenvalues of a run at each factor with a rest state; None if there are none.

    Without the gain there is only the factor 1.
    """
    assert run.config is not None
    try:
        with np.errstate(all="ignore"):
            if not _has_gain(run):
                system = linearised_at_rest(run.config)
                return (
                    None
                    if system is None
                    else Roots(run, np.ones(1), system.eigenvalues[np.newaxis])
                )
            points = root_locus(run.config, GAIN, factors)
    # Numbers near overflow can make the computation fail; the report then omits the run.
    except (ArithmeticError, ValueError, KeyError, ConfigError, np.linalg.LinAlgError):
        return None
    computed = [
        (p.factor, p.linearisation.eigenvalues) for p in points if p.linearisation is not None
    ]
    if not computed:
        return None
    return Roots(
        run, np.array([factor for factor, _ in computed]), np.array([v for _, v in computed])
    )


def _has_gain(run: Run) -> bool:
    """Whether the gain that is varied acts in a run."""
    assert run.config is not None
    return bool(np.any(getattr(run.config.controller, GAIN.rpartition(".")[2], 0.0)))


def _nominal(roots: Roots) -> Roots:
    nearest = int(np.abs(np.log(roots.factors)).argmin())
    return Roots(roots.run, roots.factors[[nearest]], roots.values[[nearest]])


def _spectra(spectra: list[Roots]) -> Figure:
    groups = alike(spectra)
    far = farthest([roots.values for roots in spectra])
    near = [r._replace(values=r.values[~is_far(r.values, far)][np.newaxis]) for r, _ in groups]
    labelled = list(zip(near, [label for _, label in groups], strict=True))
    titles = _titles(near)
    panels = tuple(
        Panel(REAL, IMAGINARY, (*_crosses(labelled, slow=slow), BORDER), title=title)
        for slow, title in titles.items()
    )
    notes = ["Eigenvalues of the motion linearised at the rest state."]
    outside = _outside(groups, far)
    if outside:
        first = replace(REAL, label=f"{REAL.label}, without those far away")
        panels = (replace(panels[0], x=first), *panels[1:])
        notes.append(f"Too far away for this figure: {outside}.")
    if len(titles) > 1:
        notes.append(
            f"Slow eigenvalues decay at most {SLOW_FACTOR:g} times as fast as the slowest."
        )
    if len(groups) > 1:
        notes.append("Each run has a symbol and a colour of its own.")
    if len(groups) < len(spectra):
        notes.append("Runs with the same eigenvalues have one entry.")
    return Figure(
        "runs-eigenvalues",
        "Eigenvalues at the rest state",
        panels,
        columns=len(panels),
        caption=" ".join(notes),
    )


def _titles(drawn: Sequence[Roots]) -> dict[bool, str]:
    """Return the titles of the panels: of one if the slow eigenvalues fill nearly the range."""
    every = np.concatenate([roots.values.ravel() for roots in drawn])
    slow = np.concatenate(
        [roots.values[_slow(roots.values, _nominal(roots).values[0])] for roots in drawn]
    )
    zooms = bool((_lengths(every) >= MIN_ZOOM * _lengths(slow))[_lengths(every) > 0].any())
    return PANEL_TITLES if zooms else {False: ""}


def _lengths(values: Array) -> Array:
    """Return the lengths of both axes of a panel: zero, the border of stability, is on it."""
    found: Array = np.array(
        [np.ptp(np.append(part, 0.0)) for part in (values.real, _imaginary(values))]
    )
    return found


def _imaginary(values: Array) -> Array:
    """Return imaginary parts as they are drawn: zero for eigenvalues that are real to round-off."""
    return np.asarray(np.where(are_real(values), 0.0, values.imag))


def _outside(groups: list[tuple[Roots, str]], far: float) -> str:
    """Return the eigenvalues that are too far away, each with its runs; "" for none."""
    found = []
    for (_, _, values), label in groups:
        # One of a pair is enough.
        own = [value for value in values[0][is_far(values[0], far)].tolist() if value.imag >= 0]
        if own:
            named = " and ".join(map(eigenvalue_text, own))
            found.append(f"λ = {named} 1/s ({label})")
    return "; ".join(found)


def _crosses(spectra: Sequence[tuple[Roots, str]], *, slow: bool) -> list[Points]:
    marks: list[Points] = []
    for (run, _, values), label in spectra:
        eigenvalues = values[0]
        if slow:
            eigenvalues = eigenvalues[_slow(eigenvalues, eigenvalues)]
        marks.append(
            Points(
                eigenvalues.real,
                _imaginary(eigenvalues),
                label,
                colour=run.number,
                symbol=SYMBOLS[run.number % len(SYMBOLS)],
                texts=tuple(_described(value) for value in eigenvalues.tolist()),
                group=run.legend,
            )
        )
    # What stands back is behind.
    return sorted(marks, key=lambda mark: not mark.group)


def _slow(values: Array, nominal: Array) -> NDArray[np.bool_]:
    """Select eigenvalues that decay at most `SLOW_FACTOR` times as fast as the slowest nominal."""
    slowest = -float(nominal.real.max(initial=-np.inf))
    # If a nominal eigenvalue does not decay, there is no slowest decay; all are selected.
    bound = SLOW_FACTOR * slowest if slowest > 0 else np.inf
    return np.asarray(-values.real <= bound)


def _described(value: complex) -> str:
    damping = -value.real / abs(value) if value else float("nan")
    imaginary = f" {value.imag:+.5g}i" if not are_real(np.asarray(value)) else ""
    return f"λ = {value.real:.5g}{imaginary} 1/s, ζ = {damping:.4g}"


def _locus(roots: Roots) -> Figure:
    run, factors, _ = roots
    panels = tuple(
        Panel(REAL, IMAGINARY, (*_branches(roots, slow=slow), BORDER), title=title)
        for slow, title in _titles([roots]).items()
    )
    return Figure(
        f"{run.name}-locus",
        f"Root locus along K_r: {run.label}",
        panels,
        columns=len(panels),
        caption=f"K_r is multiplied by {len(factors)} factors, and the rest state is computed for "
        "each. A curve has a gap where a pair of eigenvalues leaves or meets the real axis.",
    )


def _branches(roots: Roots, *, slow: bool) -> list[Mark]:
    _, factors, values = roots
    nominal = int(np.abs(np.log(factors)).argmin())
    if slow:
        values = np.where(_slow(values, values[nominal]), values, complex(np.nan, np.nan))
    lowest, highest = f"K_r times {factors[0]:g}", f"K_r times {factors[-1]:g}"
    marks: list[Mark] = [
        Line(x, y, "factors in between") for x, y in (_with_gaps(branch) for branch in values.T)
    ]
    for index, label, colour, symbol in (
        (0, lowest, 2, 2),
        (nominal, "K_r as configured", 1, 1),
        (-1, highest, 3, 3),
    ):
        marked = values[index]
        marks.append(Points(marked.real, _imaginary(marked), label, colour=colour, symbol=symbol))
    return marks


def _with_gaps(branch: Array) -> tuple[Array, Array]:
    """Return a branch as x and y, with gaps between real and complex eigenvalues."""
    real = are_real(branch)
    leaves = np.flatnonzero(real[1:] != real[:-1]) + 1
    return np.insert(branch.real, leaves, np.nan), np.insert(_imaginary(branch), leaves, np.nan)


def _sentences(runs: Sequence[Run], readable: list[Run], spectra: list[Roots]) -> list[Block]:
    sentences: list[Block] = []
    drawn = [roots.run for roots in spectra]
    unreadable = [run.label for run in runs if run.config is None]
    without_rest = [run.label for run in readable if run not in drawn]
    if unreadable:
        sentences.append(
            "No eigenvalues are drawn for runs whose config this version cannot read: "
            f"{', '.join(unreadable)}."
        )
    with_code = [run.label for run in runs if run.config is not None and has_code(run.config)]
    if with_code:
        sentences.append(
            "No eigenvalues are drawn for runs with elements of users, whose code a report never "
            f"runs: {', '.join(with_code)}. The command rbstab stability --allow-python prints "
            "them."
        )
    if without_rest:
        sentences.append(
            "No eigenvalues are drawn where no rest state was found in the range of eq. 5, or "
            f"where a force that jumps holds the body at rest: {', '.join(without_rest)}."
        )
    stopped = [roots.run.label for roots in spectra if _rests_on_stop(roots)]
    if stopped:
        sentences.append(
            "Two eigenvalues are zero where a stop holds θ2 at rest: they are those of θ2, and say "
            f"nothing on stability: {', '.join(stopped)}."
        )
    held = [label for run in drawn if (label := _surface_modes(run))]
    if held:
        sentences.append(
            "Not drawn: the three modes of a sliding surface s = F + κE, on which E decays as "
            "exp(-κt). The eigenvalues are those of the body that is held at E = 0: "
            f"{', '.join(held)}."
        )
    if len(readable) > MAX_LOCI:
        sentences.append(f"Root loci are drawn for the first {MAX_LOCI} runs only.")
    return sentences


def _rests_on_stop(roots: Roots) -> bool:
    """Whether a run rests on a stop: the linearised motion then keeps θ2 and its rate, zero."""
    assert roots.run.config is not None
    elements = roots.run.config.elements.values()
    has_stop = any(getattr(element, "method", None) == "stop" for element in elements)
    # The rows of θ2 are exactly zero, so their eigenvalues are too.
    return has_stop and np.count_nonzero(_nominal(roots).values == 0) == 2


def _surface_modes(run: Run) -> str:
    """Return the run with its κ if its connector slides on s = F + κE; "" for other runs."""
    assert run.config is not None
    slope = getattr(getattr(run.config.controller, "surface", None), "slope", None)
    return f"{run.label} (κ = {slope:g} 1/s)" if slope is not None else ""
