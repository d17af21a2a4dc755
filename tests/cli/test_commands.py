"""The command line as a whole: help, imports, exit codes, options given twice, packages."""

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import click
import jsonschema
import pytest
import yaml
from cli.conftest import GOOD, PLAN_OF_MASSES, ended, json_of, rbstab, replace_everywhere, success
from support.made_runs import made_file

from rbstab_cli import exit_codes, main
from rbstab_cli.main import cli
from rbstab_cli.registry import COMMANDS, FIRST_STEPS


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_a_command_ends_with_an_example(name, folder):
    """It is on one line, and its words are arguments and options that the command has."""
    *_, title, line = rbstab(name, "--help").stdout.rstrip().splitlines()
    assert title.strip() == "Example:"
    example = line.strip()
    program, command_name, *words = shlex.split(example.partition(" > ")[0])
    assert (program, command_name) == ("rbstab", name)
    command = cli.get_command(click.Context(cli), name)
    assert command is not None
    context = command.make_context(name, words)
    assert context.args == []


def test_the_help_ends_with_the_first_steps():
    assert rbstab("--help").stdout.endswith(f"{FIRST_STEPS}\n")


UNUSED_PACKAGES = ("heyoka", "rich", "flint", "loky", "multiprocessing")
OPTIONAL_PACKAGES = ("xarray", "netCDF4", "pandas", "vl_convert", "typst", "distributed")
UNUSED_MODULES = (
    "rbstab.proof",
    *("rbstab.experiment.proof", "rbstab.experiment.stored_proof"),
    "rbstab.experiment.convergence.exact_motion",
    *(
        "rbstab.processes.workers",
        "rbstab.processes.mapped",
        "rbstab.store.table",
        "rbstab.sweep",
    ),
    *("rbstab.integrate.heyoka", "rbstab.report"),
)


def printed_by(code):
    """Return the words that a program of its own process prints last, on a line."""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split())


def imported_by(*words):
    """Return the names of all modules that a process has after a command."""
    return printed_by(
        "import sys\n"
        "from rbstab_cli.main import main\n"
        f"sys.argv = ['rbstab', *{words}]\n"
        "try:\n"
        "    main()\n"
        "except SystemExit as stop:\n"
        "    assert stop.code == 0\n"
        "print(*sys.modules)\n"
    )


def test_help_does_not_wait_for_numerical_packages():
    heavy = {"numpy", "scipy", "h5py", "yaml", "pydantic", "rich", "heyoka"}
    assert not heavy & imported_by("--help")


@pytest.mark.parametrize("options", [("--json", "-q"), ()])
def test_a_run_imports_nothing_that_it_does_not_use(options, folder):
    modules = imported_by("run", "--no-prove", "good.yaml", *options)
    assert {"scipy.integrate", "h5py", "rbstab.experiment.run_to_file"} <= modules
    assert not {*UNUSED_PACKAGES, *OPTIONAL_PACKAGES, *UNUSED_MODULES} & modules


def test_a_sweep_by_heyoka_imports_no_scipy():
    pytest.importorskip("heyoka")
    # SciPy is imported for the comparison, after all members.
    modules = printed_by(
        "import sys, rbstab.sweep.sweep, rbstab.sweep.members.ensemble\nprint(*sys.modules)\n"
    )
    assert "rbstab.integrate.heyoka.engine" in modules
    assert not {"scipy", *OPTIONAL_PACKAGES} & modules


def test_numbers_that_are_not_finite_are_null_in_json(folder):
    Path("good.yaml").write_text(GOOD.replace("[1, 2, -1]", "[1e200, 0, 1e200]"))
    ended(3, "run", "--no-prove", "good.yaml")
    facts = json_of("show", "results/good.h5")
    assert facts["status"] == "diverged"
    assert facts["lyapunov_start"] is None


def test_the_printed_schema_accepts_a_config(folder):
    schema = json.loads(rbstab("schema").stdout)
    jsonschema.validate(yaml.safe_load(GOOD), schema)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(yaml.safe_load(GOOD.replace("mass: 41", "mass: -41")), schema)


def test_completion_completes(monkeypatch):
    environment = {"_RBSTAB_COMPLETE": "bash_complete", "COMP_WORDS": "rbstab s", "COMP_CWORD": "1"}
    for key, value in environment.items():
        monkeypatch.setenv(key, value)
    done = subprocess.run(
        [sys.executable, "-m", "rbstab_cli"], capture_output=True, text=True, check=False
    )
    commands = ["sweep", "show", "stability", "sensitivities", "schema"]
    assert done.stdout.split() == [f"plain,{command}" for command in commands]


def test_plans_and_configs_are_checked(folder):
    Path("plan.yaml").write_text(PLAN_OF_MASSES)
    done = success("check", "plan.yaml", "good.yaml")
    plan, config = done.stdout.splitlines()
    assert plan.startswith("plan.yaml: valid: the plan of a sweep, 2 members, free, sweep id ")
    assert config.startswith("good.yaml: valid: free, coordinates Z, engine scipy, run id ")
    assert not Path("results").exists()


NEEDED = {
    "run good.yaml --engine heyoka": ("heyoka", "the engine 'heyoka' cannot be used here"),
    "tune good.yaml --objective energy --over controller.L_r": ("heyoka", "need heyoka"),
    "fit good.yaml m.csv --free controller.L_r": ("heyoka", "need heyoka"),
    "sensitivities good.yaml": ("heyoka", "need heyoka, which cannot be used here"),
    "sweep plan.yaml --dask tcp://127.0.0.1:9": ("distributed", "rbstab[cluster]"),
    "export made.h5 -o a.parquet": ("pandas pyarrow", "rbstab[table]"),
    "export made.h5 -o a.csv": ("pandas pyarrow", ""),
    "report made.h5 -o a.md": ("vl_convert typst", "rbstab[report]"),
    "report made.h5 -o a.pdf": ("vl_convert typst", "rbstab[report]"),
    "report made.h5 -o a.html": ("vl_convert typst", ""),
}
"""Commands with the packages that are missing, and what is said then; "" if they are not needed."""

WITHOUT = """
import sys
for name in sys.argv.pop(1).split():
    sys.modules[name] = None  # as if it were not installed
from rbstab_cli.main import main
main()
"""


@pytest.mark.heavy
@pytest.mark.parametrize("command", NEEDED)
def test_a_command_names_the_package_that_it_needs(command, folder):
    Path("plan.yaml").write_text(PLAN_OF_MASSES)
    made_file(folder / "made.h5")
    Path("m.csv").write_text("time [s],theta1 [rad]\n0,1\n")
    packages, message = NEEDED[command]
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT, packages, *command.split()],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == (2 if message else 0)
    assert message in done.stderr
    assert "Traceback" not in done.stderr


ROOT = Path(__file__).parents[2]


def test_the_docs_and_the_help_list_every_code():
    codes = {value for name, value in vars(exit_codes).items() if name.isupper()}
    table = (ROOT / "docs/commands.md").read_text(encoding="utf-8").partition("## Exit codes")[2]
    assert {int(code) for code in re.findall(r"^\| (\d+) \|", table, re.MULTILINE)} == codes
    told = " ".join(rbstab("--help").stdout.split()).partition("Exit codes:")[2]
    assert {int(code) for code in re.findall(r"(?:^|; ) ?(\d+) ", told)} == codes


def code_of(monkeypatch, *words):
    """Return the exit code of the program in this process."""
    monkeypatch.setattr(sys, "argv", ["rbstab", *words])
    for name in ("prepare_streams", "handle_interrupts", "stop_handling"):
        monkeypatch.setattr(main, name, lambda: None)
    with pytest.raises(SystemExit) as caught:
        main.main()
    return caught.value.code


def test_the_codes_of_commands(folder, monkeypatch):
    short = ("run", "good.yaml", "--no-prove", "-q")
    assert code_of(monkeypatch, "check", "good.yaml") == exit_codes.OK
    assert code_of(monkeypatch, "check", "missing.yaml") == exit_codes.USAGE
    assert code_of(monkeypatch, "run") == exit_codes.USAGE
    # At 50 rad/s the body leaves the range of θ2 within the tenth of a second.
    spin = ("--set", "initial.angular_velocity=[0, 50, 0]")
    assert code_of(monkeypatch, *short, *spin) == exit_codes.NOT_COMPLETED
    assert code_of(monkeypatch, "show", "missing.h5") == exit_codes.STORAGE


def test_an_unexpected_error_is_not_hidden(folder, monkeypatch):
    """Python prints its traceback and ends with `exit_codes.INTERNAL`."""

    def fail(*_: object, **__: object) -> None:
        raise ZeroDivisionError

    replace_everywhere(monkeypatch, "rbstab.config.warnings.config_warnings", fail)
    with pytest.raises(ZeroDivisionError):
        code_of(monkeypatch, "check", "good.yaml")


def single_value_options():
    """Yield the name of each command with each of its options that takes one value."""
    context = click.Context(cli)
    for name in COMMANDS:
        command = cli.get_command(context, name)
        assert command is not None
        for option in command.params:
            if isinstance(option, click.Option) and option.nargs == 1 and not option.is_flag:
                yield from ((name, spelling) for spelling in option.opts if not option.multiple)


@pytest.mark.parametrize(("command", "option"), [*single_value_options()])
def test_one_value_given_twice_is_refused(command, option):
    done = ended(2, command, option, "a", option, "b")
    assert done.stderr.startswith(f"Usage: rbstab {command} ")
    assert " is given 2 times, and takes one value.\n" in done.stderr


def test_two_spellings_are_one_option():
    done = rbstab("run", "good.yaml", "-o", "a", "--output", "b")
    assert "Error: --output is given 2 times" in done.stderr
