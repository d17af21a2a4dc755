"""`rbstab stability`: what is computed of each config, and in which order."""

from pathlib import Path

from rbstab.config.build import problem_of
from rbstab.config.schema import Config
from rbstab.experiment.convergence.convergence import Convergence, Enclose, stored_convergence
from rbstab.experiment.convergence.exact_motion import prove_convergence
from rbstab.experiment.proof import prove
from rbstab.experiment.proof_cache import OLDER, cached_proof, is_older, proof_for
from rbstab.experiment.run_to_file import finished_run
from rbstab.experiment.simulate import simulate_problem
from rbstab.experiment.stability import stability_of
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.integrate.problem import Problem
from rbstab.report.runs.figures.branches import branch_figure
from rbstab.report.writers.figure_files import figure_bytes
from rbstab.store.errors import StoreError
from rbstab.store.result import Result
from rbstab_cli.inputs import load_configs
from rbstab_cli.output.files import check_target, figure_form, stdout_to_file, write_file
from rbstab_cli.output.progress import compiling, working
from rbstab_cli.printing import print_json, say
from rbstab_cli.work.stability.along import checked_along, locus_of
from rbstab_cli.work.stability.bound import asked_bound, proved_bound
from rbstab_cli.work.stability.printed import Analysis, data_of, print_analysis
from rbstab_cli.work.stability.within import (
    SECONDS_OF_BODIES,
    checked_tolerances,
    late_after,
    proved_within,
)


def stability(
    configs: tuple[Path, ...],
    search_only: bool,
    alongs: tuple[str, ...],
    figure: Path | None,
    withins: tuple[str, ...],
    largest: tuple[str, ...],
    time_limit: float | None,
    bounds: tuple[str, ...],
    tilt: str | None,
    largest_bound: bool,
    changes: tuple[str, ...],
    allow_python: bool,
    results: Path,
    no_run: bool,
    as_json: bool,
    output: Path | None,
    force: bool,
) -> None:
    """Compute everything that was asked for about each config, then print it.

    Args:
        configs: The files of the configs.
        search_only: Whether rest states are searched for without a proof.
        alongs: The values of --along: KEY=FROM:TO:COUNT.
        figure: The file of a figure of the rest states along parameters; None: none is drawn.
        withins: The values of --within: KEY=±SIZE.
        largest: The values of --largest-within: keys.
        time_limit: The wall time for each proof within tolerances or along a parameter, s; None:
            the default.
        bounds: The values of --bound: KIND=SIZE.
        tilt: The value of --within-tilt, rad; None without it.
        largest_bound: Whether the largest load of --bound is looked for.
        changes: Texts `key=value` that replace single values of the config.
        allow_python: Whether the files of users' elements may be run.
        results: The folder of results, whose proofs are read and stored.
        no_run: Whether to leave out the run and its certificate.
        as_json: Whether to print JSON.
        output: The file for what is printed; None: stdout.
        force: Whether existing files are replaced.
    """
    if output is not None:
        check_target(output, force=force)
    form = None if figure is None else figure_form("--figure", figure, force=force)
    loaded = load_configs(configs, changes, allow_python=allow_python)
    tolerances = checked_tolerances(loaded, withins, largest)
    loci = checked_along(loaded.values(), alongs)
    limit = 0.0 if search_only else time_limit or SECONDS_OF_BODIES
    asked = asked_bound(bounds, tilt, largest=largest_bound)
    enclose = Enclose.NOTHING if search_only else Enclose.UNTIL_PROVED
    every = []
    for path, config in loaded.items():
        within = None
        if withins or largest:
            within = proved_within(
                path.name,
                config,
                results,
                withins,
                tolerances[path],
                largest,
                time_limit,
            )
        bound = None if asked is None else proved_bound(path.name, config, asked)
        problem = problem_of(config)
        with working(f"{path.name}: rest states"):
            proof = _proof(config, problem, results, search_only=search_only)
        label = compiling(config.integration.engine, len(problem.system.elements)) or "exact motion"
        with working(f"{path.name}: {label}"):
            stored = results / f"{path.stem}.h5"
            run = None if no_run else _run(config, problem, stored, proof, enclose)
            motion = None if search_only else _convergence(config, problem, proof, run)
        with working(f"{path.name}: --along"):
            along = [locus_of(config, parameter, late_after(limit)) for parameter in loci]
        stable = stability_of(problem, proof, motion)
        every.append(Analysis(path, config, stable, run, along, within, bound))
    if figure and form:
        drawn = branch_figure(
            (locus.axis, locus.states) for analysis in every for locus in analysis.loci
        )
        write_file(figure, figure_bytes(drawn, form), force=force)
    with stdout_to_file(output, force=force):
        if as_json:
            print_json([data_of(analysis) for analysis in every])
        else:
            for analysis in every:
                print_analysis(analysis)


def _proof(config: Config, problem: Problem, results: Path, *, search_only: bool) -> Proof:
    try:
        if search_only:
            cached = cached_proof(results, config)
            decided = cached is not None and (cached.proved or cached.states)
            return cached if cached and decided else prove(config, problem, search_only=True)
        if is_older(results, config):
            say(f"{results}: {OLDER}")
        return proof_for(results, config, problem)
    except StoreError as error:
        # Print the proof although it cannot be read or stored.
        say(f"warning: {error}; the proof is not stored")
        return prove(config, problem, search_only=search_only)


def _convergence(config: Config, problem: Problem, proof: Proof, run: Result | None) -> Convergence:
    """Return what is proved of the exact motion: that of the run, or else it is followed now."""
    stored = None if run is None else stored_convergence(run.attributes)
    if stored is not None and stored.enclosed.covers(Enclose.UNTIL_PROVED):
        return stored
    return prove_convergence(config, problem, proof).convergence


def _run(config: Config, problem: Problem, file: Path, proof: Proof, enclose: Enclose) -> Result:
    """Return the stored run of a config if it has finished, or else integrate it."""
    finished = finished_run(config, problem, file, proof=proof)
    if finished is not None:
        return finished
    return simulate_problem(config, problem, proof=proof, enclose=enclose)
