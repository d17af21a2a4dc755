"""The example at the end of each command's help: a command line that can be typed as it is."""

FIRST_STEPS = "First steps: rbstab init, then rbstab run experiment.yaml."
"""The end of `rbstab --help`."""

EXAMPLES = {
    "init": "rbstab init my_experiment",
    "examples": "rbstab examples real_body",
    "run": "rbstab run experiment.yaml --set body.mass=50",
    "sweep": "rbstab sweep sweep.yaml",
    "gather": "rbstab gather results/sweep",
    "check": "rbstab check experiment.yaml sweep.yaml",
    "show": "rbstab show results/experiment.h5",
    "list": "rbstab list results",
    "compare": "rbstab compare results/a.h5 results/b.h5",
    "export": "rbstab export results/sweep -o sweep.csv",
    "report": "rbstab report results/experiment.h5 results/sweep -o report.html",
    "plot": "rbstab plot results/experiment.h5 --figure run-1-energy -o energy.pdf",
    "stability": "rbstab stability experiment.yaml --within controller=±20%",
    "verify": "rbstab verify results",
    "sensitivities": "rbstab sensitivities experiment.yaml",
    "tune": "rbstab tune experiment.yaml --objective settling_time --over controller.L_c",
    "guard": "rbstab guard experiment.yaml -o guarded.yaml",
    "cache": "rbstab cache --clear",
    "schema": "rbstab schema > rbstab.schema.json",
    "completion": "rbstab completion bash",
}
"""The example of each command."""


def example_of(name: str) -> str:
    """Return the last lines of the help of a command; click leaves the line as it is."""
    return f"\b\nExample:\n  {EXAMPLES[name]}"
