"""The programs of the benchmark, with the ladder of settings of each."""

from dataclasses import dataclass

TOLERANCES = tuple(float(f"{digits}e-{power}") for power in range(4, 14) for digits in (3, 1))
"""3e-4, 1e-4, 3e-5, ..., 1e-13."""

STEPS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)
"""Numbers of time steps between two samples."""


@dataclass(frozen=True)
class Peer:
    """One row of the table.

    Args:
        title: Its name in the table.
        script: The file in `benchmarks/peers`.
        packages: What pip installs in its environment; empty: it runs in that of rbstab.
        besides: What it computes besides the states.
        argument: The argument of the script, if it has one.
        setting: What is set; with `ladder`, from the coarsest setting to the finest.
        largest_batch: The largest number of members that is timed.
    """

    title: str
    script: str
    packages: tuple[str, ...] = ()
    besides: str = "none"
    argument: str = ""
    setting: str = "tolerance"
    ladder: tuple[float, ...] = TOLERANCES
    largest_batch: int = 16_384

    @property
    def environment(self) -> str:
        """The name of its environment."""
        return self.script.removesuffix(".py")


RUN = "v, v', energies and dissipation, audit, forces, certificate, result file"
SUMMARY = "v, audit, peaks and their errors, settling times, rest state, status, stored table"

PEERS = (
    Peer("`rbstab sweep`, summaries", "rbstab_sweep.py", (), SUMMARY, "summary"),
    Peer(
        "`rbstab sweep`, `keep: traces`",
        "rbstab_sweep.py",
        (),
        "the same; also v, v', audit and contact force at all samples, stored with the states",
        "traces",
    ),
    Peer("`rbstab run`, heyoka", "rbstab_run.py", (), RUN, "heyoka"),
    Peer("`rbstab run`, scipy", "rbstab_run.py", (), RUN, "scipy"),
    *(
        Peer(
            f"`solve_ivp` ({method}), {kind} equations",
            f"scipy_{kind}.py",
            packages,
            argument=method,
        )
        for kind, packages in (
            ("numpy", ("numpy", "scipy")),
            ("numba", ("numba", "numpy", "scipy")),
        )
        for method in ("DOP853", "LSODA")
    ),
    # Of its explicit methods Tsit5 was the fastest here.
    # More members at once are slower: they leave the processor's cache.
    Peer("diffrax (Tsit5), vmapped", "diffrax_vmap.py", ("jax", "diffrax"), largest_batch=1024),
    Peer("Drake, `runge_kutta3`", "drake_plant.py", ("drake",), argument="runge_kutta3"),
    Peer("Drake, `runge_kutta5`", "drake_plant.py", ("drake",), argument="runge_kutta5"),
    Peer("MuJoCo, RK4", "mujoco_steps.py", ("mujoco",), setting="steps per sample", ladder=STEPS),
)
