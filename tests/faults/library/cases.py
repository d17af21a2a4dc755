"""The commands that are disturbed, and the folder that each of them finds."""

from typing import NamedTuple

BODY = """\
title: {title}
body: {{mass: {mass}, inertia: [10.0, 9.0, 2.0], contact_point: [0.15, 0.10, -0.42]}}
controller:
  variant: free
  K_t: [4100, 4100, 3280]
  L_t: [200, 200, 140]
  K_r: [400, 400, 320]
  L_r: [60, 60, 42]
initial: {{angular_velocity: [1, 2, -1]}}
integration: {{duration: 0.05, samples: 5, rtol: 1.0e-9}}
"""

PLAN = """\
title: A small sweep
base: a.yaml
vary:
  initial.angular_velocity[0]: {linspace: [-3, 3, 4]}
keep: traces
"""

INPUTS = {
    "a.yaml": BODY.format(title="A short run", mass=41),
    "b.yaml": BODY.format(title="Another run", mass=50),
    "plan.yaml": PLAN,
}
"""The files of the user, in the working folder. The disturbed folder is `results` beside them."""


class Case(NamedTuple):
    """A command under test.

    Args:
        arguments: The arguments of `rbstab`.
        before: Commands that have run before, undisturbed.
        lines: The most lines on stderr after a fault.
        first: A command that does the first part of the work; its files may be there as well.
        optional: The start of the names of files that may be missing after a warning.
        names_unread: The start of the names of files that name results that could not be read.
        prints: Whether it always prints the same on stdout. Others print how long they took.
    """

    arguments: str
    before: tuple[str, ...] = ()
    lines: int = 1
    prints: bool = False
    first: str = ""
    optional: str = "-"
    names_unread: str = "-"


_EARLIER = ("run b.yaml --prove",)
_SWEEP = "sweep --no-prove plan.yaml --shard-size 2"
_HERE = f"{_SWEEP} --engine scipy --threads 1"
_HEYOKA = f"{_SWEEP} --engine heyoka"
_REPORT = "report results/b.h5 results/a.h5 results/plan -q -o results"
_SOURCES = (*_EARLIER, "run --no-prove a.yaml", _HERE)
_GAIN = "--objective energy --over controller.L_r --bounds 0.9:1.1"


def _report(name):
    """Return a report that replaces an older one."""
    older = f"report results/b.h5 -q -o results/{name}"
    return Case(f"{_REPORT}/{name}", (*_SOURCES, older), lines=4, names_unread="report")


CASES = {
    "run": Case("run --no-prove a.yaml -q", _EARLIER),
    "run again": Case("run --no-prove a.yaml -q", (*_EARLIER, "run --no-prove a.yaml")),
    "run replacing": Case("run --no-prove a.yaml -q --force", (*_EARLIER, "run --no-prove a.yaml")),
    "run setting aside": Case(
        "run --no-prove a.yaml -q --force", (*_EARLIER, "run --no-prove a.yaml --set body.mass=42")
    ),
    "run several": Case("run --no-prove a.yaml b.yaml -q", lines=2),
    "run proving": Case("run a.yaml --prove -q", _EARLIER, first="run a.yaml --no-prove -q"),
    "sweep": Case(f"{_HERE} -q", _EARLIER),
    "sweep resumed": Case(f"{_HERE} -q", (*_EARLIER, f"{_HERE} --part 1/2")),
    "sweep of a part": Case(f"{_HERE} --part 2/2 -q", (*_EARLIER, f"{_HERE} --part 1/2")),
    "sweep setting aside": Case(f"{_HERE} --force -q", (*_EARLIER, f"{_HERE} --set body.mass=42")),
    "sweep by workers": Case(f"{_HEYOKA} --threads 2 -q", _EARLIER),
    "sweep after its parts": Case(f"{_HERE} -q", (*_EARLIER, f"{_HERE} --part 1/1")),
    "sweep comparing": Case(f"{_HEYOKA} -q", (*_EARLIER, f"{_HEYOKA} --part 1/1")),
    "sweep again": Case(f"{_HERE} -q", (*_EARLIER, _HERE)),
    "report html": _report("report.html"),
    "report md": _report("report.md"),
    "report pdf": _report("report.pdf"),
    "report text": _report("report.txt"),
    "report json": Case("report results/a.h5 results/plan --json", _SOURCES, lines=3, prints=True),
    "stability": Case(
        "stability a.yaml -o results/stability.txt --force --along controller.K_r=x0.1:x1:3",
        ("run --no-prove b.yaml",),
        lines=2,
        optional="proofs/",
    ),
    "sensitivities": Case(
        "sensitivities a.yaml -o results/sensitivities.json --force", _EARLIER, prints=True
    ),
    "tune": Case(f"tune a.yaml -o results/tuned.yaml --force {_GAIN}", _EARLIER),
    "show": Case("show results/a.h5 --json", ("run --no-prove a.yaml",), prints=True),
}
"""The commands under test, by name."""
