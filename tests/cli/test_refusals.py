"""One table of commands that cannot be done: wrong files, options and values. Each is told with its
exit code and the way on, before any work, and changes no file.
"""

import shlex
import shutil
from pathlib import Path

import pytest
from cli.conftest import GOOD, STORED, ended, rbstab
from cli.conftest import PLAN_OF_MASSES as PLAN
from support.made_runs import made_file
from support.printed_paths import printed
from support.stored_proofs import store_proof_of

from rbstab.files.text import shell_word
from rbstab_cli.commands.running import sweep

HELD = GOOD.replace("variant: free", "variant: permanent")

PUSHED = "schema_version: 2\nelements: {{{}}}\n"

BARRIER = "{kind: guard, method: barrier, stiffness: 3}"

STICKING = "variant: sliding\n  K_s: [9, 9, 9]\n  surface: position\n  stick_energy: 0.5"

FILES = {
    **dict.fromkeys(("good.yaml", "a b/good.yaml", "twice/good.yaml", "mine.txt"), GOOD),
    **dict.fromkeys(("plan.yaml", "twice/plan.yaml", "plan.txt", "-a b.yaml"), PLAN),
    "held.yaml": HELD,
    "barriers.yaml": HELD + PUSHED.format(f"a: {BARRIER}, b: {BARRIER}"),
    "outer.yaml": HELD + PUSHED.format(f"a: {BARRIER[:-1]}, outer_stiffness: 2}}"),
    "sticks.yaml": GOOD.replace("variant: free", STICKING),
    "wrong.yaml": GOOD.replace("mass: 41", "mass: -41").replace("K_r", "Kr"),
    "wrong_plan.yaml": PLAN.replace("values", "valeus"),
    "wrong_member.yaml": PLAN.replace("[40, 41]", "[-1]"),
    "wrong_proofs.yaml": f"{PLAN}prove: {{motion: {{steps: 0}}}}\n",
    "neither.yaml": "title: x\n",
    "both.yaml": "base: good.yaml\nbody: {}\n",
    "nothing.yaml": "",
    "open.yaml": "a: [",
    "list.yaml": "body: 3\n",
    **dict.fromkeys(("there.csv", "there.nc", "text.h5", "mine.py"), "mine"),
    "empty.h5": "",
    "notes.txt": "some: notes\n",
    "results/mine/notes.md": "mine",
}

KEYS_ARE_NO_OPTIONS = {
    "run good.yaml --duration 3": "Change the config: --set integration.duration=VALUE",
    "run --mass=3 good.yaml": "Change the config: --set body.mass=VALUE",
    "stability good.yaml --K_r 3": "Change the config: --set controller.K_r=VALUE",
    "run --outptu x good.yaml": "Did you mean '--output'?",
    "run --xyzzy good.yaml": "No such option",
    "show --duration good.yaml": "No such option",
    "run good.yaml -m 3": "No such option",
    "--vers": "No such option",
}

NO_COMMANDS = {
    "xyzzy": "No such command 'xyzzy'.\n",
    "swep": "No such command 'swep'. Did you mean sweep?\n",
    "Report": "Did you mean report?",
    "prove": "Did you mean stability?",
    "help shwo": "Did you mean show?",
    "version": "Did you mean --version?",
    "good.yaml": "good.yaml is not a command. Run this config: rbstab run good.yaml\n",
    "'a b/my case.yml'": f"Run this config: rbstab run {shell_word(Path('a b/my case.yml'))}\n",
    "plan.yaml": "Run this plan: rbstab sweep plan.yaml\n",
    f"{'a' * 300}.yaml": "a.yaml is not a command. Run this config: rbstab run ",
    "a.h5": "a.h5 is not a command. Look at this result: rbstab show a.h5\n",
    **dict.fromkeys(("run", "check a --set", "show", "sensitivities"), " "),
    "tune good.yaml --objective energy": "Missing option '--over'",
}

WRONG_CONFIGS = {
    "run good.yaml wrong.yaml none.yaml": "wrong.yaml:7:3: controller.Kr: is unknown (did you mean "
    "K_r?)\nnone.yaml:1:1: cannot be read",
    "run wrong.yaml": "wrong.yaml:2:14: body.mass: is -41 (expected a number greater than 0)\n",
    "check wrong.yaml good.yaml wrong_plan.yaml": "controller.Kr: is unknown (did you mean K_r?)\n"
    "wrong_plan.yaml:2:20: vary.body.mass.valeus: is unknown (did you mean values?)\n",
    "stability good.yaml list.yaml": "list.yaml:1:7: body: is 3 (expected a mapping)\n",
    "check good.yaml --set integration.samples=1": "--set integration.samples:1:21: "
    "integration.samples: is 1 (expected a number at least 2)\n",
    "sensitivities good.yaml --set body.mass=0": "body.mass: is 0",
    "sensitivities sticks.yaml": "error: controller.stick_energy: is 0.5 J, so that the "
    "motion is changed where an axis sticks (expected 0)\n",
    "run good.yaml twice/good.yaml": "would both write",
    "run plan.yaml twice/plan.yaml --member 1": "plan.yaml, member 1 would both write "
    "results/plan-member1.h5",
    "run configs/paper/case1_permanent.yaml": "`rbstab examples paper/case1_permanent` copies it",
    "sweep configs/sweeps/variants.yaml": "`rbstab examples sweeps/variants` copies it)",
    "run configs/none.yaml": "`rbstab examples` lists others)",
    "run configs/examples.yaml": "cannot be read",
    "guard barriers.yaml": "error: elements: has the barriers a, b (expected one)\n",
    "guard outer.yaml": "elements.a.outer_stiffness: is 2, and a barrier on θ2 alone would take",
}

PLANS_AND_CONFIGS = {
    "run plan.yaml": "plan.yaml:1:1: is the plan of a sweep (expected a config; run all its "
    "members: rbstab sweep plan.yaml; one: rbstab run plan.yaml --member N)\n",
    "run -- '-a b.yaml'": f"rbstab sweep {shell_word(Path('./-a b.yaml'))}; one: rbstab run",
    "stability plan.yaml good.yaml": "plan.yaml:1:1: is the plan of a sweep",
    "sweep 'a b/good.yaml'": "is a config (expected a plan with base and vary; run it: rbstab run "
    f"{shell_word(Path('a b/good.yaml'))})\n",
    **dict.fromkeys(
        (f"sweep {x}.yaml" for x in ("neither", "both", "nothing")), "vary: is missing"
    ),
    "run good.yaml --member 0": "is a config (expected a plan with base and vary; run it: rbstab",
    "run plan.yaml --member 2": "plan.yaml: has no member 2 (expected 0 to 1)\n",
    "run none.yaml --member 0": "none.yaml:1:1: cannot be read",
    "run wrong_member.yaml --member 0": "wrong_member.yaml:2:",
    "run plan.yaml --member -1": "-1 is not in the range x>=0",
    "run plan.yaml --member two": "'two' is not a valid integer",
    "sweep wrong_plan.yaml": "wrong_plan.yaml:2:20: vary.body.mass.valeus",
    "sweep wrong_proofs.yaml": "prove.motion.steps: is 0 (expected a number at least 1)\n",
    "sweep": "expected PLAN or --status DIR",
    "sweep plan.yaml --status results": "--status",
    "sweep --status results/map --force --set a=1 --fail-fast": "--status cannot be combined with "
    "--set, --fail-fast, --force\n",
    "sweep plan.yaml --threads 0": "--threads",
    "sweep plan.yaml --compare 0": "--compare",
}

WRONG_KINDS = {
    "show good.yaml": "is a config, not a result. Run it: rbstab run good.yaml; or",
    "show open.yaml": "open.yaml is a YAML file, not a result. Check it: rbstab check ",
    "show mine.txt": "mine.txt is a config, not a result. Run it: rbstab run mine.txt",
    "show plan.txt": "plan.txt is the plan of a sweep, not a result. Run it: rbstab sweep plan.txt",
    "show results/begun/plan.yaml": "check it: rbstab check results/begun/plan.yaml",
    "show results/map --config": "is a sweep; only a run has a config to print",
    "show results/good.h5 --json --config": "--json",
    "run results/good.h5": "results/good.h5:1:1: is the file of a result (expected a config; look "
    "at it: rbstab show results/good.h5)\n",
    "sweep results/good.h5": "is the file of a result (expected a plan with base and vary; look at",
    "check results/good.h5": "is the file of a result (expected a config; look at it",
    "verify good.yaml": "is a config, not a proof. Prove it: rbstab stability good.yaml. Proofs",
    "verify mine.txt": "mine.txt is a config, not a proof. Prove it: rbstab stability mine.txt",
    "verify plan.yaml": "is the plan of a sweep, not a proof. Proofs are the files in DIR/proofs",
    "verify results/good.h5": "results/good.h5 is a result, not a proof. ",
    "report results/good.h5 --format text -o results/good.h5 --force": "is one of the results",
    "report results --format text -o results/good.h5 --force": "Choose another name with -o.",
}

WITHOUT_EFFECT = {
    "run good.yaml --to-end --no-prove": "--to-end has no effect without --prove\n",
    "run good.yaml --engine heyoka --set integration.engine=scipy": "Use only --engine.",
    "sweep plan.yaml --set integration.engine=scipy": "has no effect here. Use only --engine.",
    "sweep plan.yaml --set body.mass=50": "--set body.mass:1:1: body.mass: has no effect, because "
    "the plan varies it (expected a key that the plan does not vary)\n",
    "run plan.yaml --member 0 --set body.mass=50": "has no effect, because the plan varies it",
    "check": "expected CONFIG or --element FILE",
    "check --element mine.py --set a=1": "--set has no effect without CONFIG",
    "check --element mine.py --allow-python": "--allow-python has no effect without CONFIG",
    "init --element new.py --variant free": "--element cannot be combined with --variant\n",
    "init somewhere --element": "--element cannot be combined with DIR\n",
    "init --force": "--force has no effect without --element\n",
    "verify PROOF --allow-python": "--allow-python has no effect without --config",
    "verify PROOF --set body.mass=5": "--set",
    "verify PROOF --second": "--second has no effect without --config",
    "verify results --certificate a.json": "--certificate needs the file of one proof",
    "verify PROOF PROOF2 --certificate a.json": "--certificate needs the file of one proof",
    "stability good.yaml --search-only --within body.mass=±1%": "combined with --within\n",
    "stability good.yaml --search-only --largest-within body": "combined with --largest-within\n",
    "plot results/good.h5 --column": "--column has no effect without -o\n",
    "plot results/good.h5 --figure runs-decay": "--figure has no effect without -o\n",
    "plot results/good.h5 --figure runs-decay -o a.csv --column": "--column is of use only with",
    "guard held.yaml --soft-angle 1.2": "--method barrier has no use for --soft-angle",
    "guard held.yaml --limit 5": "--method barrier has no use for --limit",
    "examples --all joint": "--all cannot be combined with NAME",
    **{
        f"sweep plan.yaml {option} {other}": f"{option.split()[0]} cannot be combined with "
        f"{other.split()[0]}"
        for option, other in (
            ("--part 1/2", "--force"),
            ("--part 1/2", "--compare 5"),
            ("--dask tcp://x:1", "--threads 2"),
            ("--dask tcp://x:1", "--dry-run"),
        )
    },
}

WRONG_VALUES = {
    **{
        f"sweep plan.yaml --part '{part}'": "Invalid value for '--part'"
        for part in ("0/3", "4/3", "-1/3", "1", "1/", "/3", "1/3/2", "1.0/2", "x/y", "1/0", "")
    },
    **dict.fromkeys(
        ("show ''", "run good.yaml ''", "list ''", "run good.yaml -o ''"),
        ": it is empty; expected a path.\n",
    ),
    "sweep plan.yaml --engine heyoke": "Did you mean heyoka?",
    "report x.h5 --format htm": "Did you mean html?",
    "report results/good.h5 -o x.html --format pdf": "x.html is the name of a file of the format "
    "html, and --format says pdf",
    "report results/good.h5 -o r.doc": "expected one of .html, .htm, .md, .markdown, .pdf, .txt,",
    "export results/good.h5 -o a.xlsx": "expected a file name that ends in .csv, .parquet, .mat",
    "export results/good.h5 results/map -o a.csv": "expected runs only, or one sweep",
    **dict.fromkeys(
        (
            "export results/good.h5 -o a.nc",
            "export results/good.h5 results/map -o a.nc",
            "export results/map --traces -o a.nc",
        ),
        "-o a.nc: expected one sweep, without --traces",
    ),
    "plot results/good.h5 --figure runs-decay -o a.gif": "expected a file name that ends in .svg",
    "plot results/good.h5 --figure run-1-enrgy -o a.csv": "did you mean run-1-energy?",
    "plot results/good.h5 --figure decay -o a.svg": "--figure decay: unknown; expected one of",
    "init --variant visco": "did you mean visco-elastic?\n",
    "examples case1_permanant": "did you mean paper/case1_permanent?",
    "examples paper/case": "? `rbstab examples` lists them.\n",
    "examples zzz": "zzz. `rbstab examples` lists them.\n",
    "examples papr/case1_permanent": "did you mean paper/case1_permanent?",
    "examples case1": "did you mean paper/case1_guarded or paper/case1_permanent?",
    "examples ../pyproject": "no example ../pyproject",
    "guard held.yaml --method stiff --soft-angle 1.6": "--soft-angle is 1.6 (expected between 0",
    "guard held.yaml --method stiff --soft-angle nan": "--soft-angle is nan",
    "guard held.yaml --method stiff --limit 0": "--limit is 0 (expected a couple above 0, N m)",
    "guard held.yaml --method stop": "'stop' is not one of 'barrier', 'stiff', 'repelling'",
    "tune good.yaml --objective setling --over controller.L_r": "Did you mean settling_time?",
    **{
        f"tune good.yaml --objective energy --over {over}": message
        for over, message in {
            "controller.K_c": "error: controller.K_c: is not a gain",
            "controller.Kr": "controller.L_r; did you mean controller.K_r?)",
            "''": ": is not a gain",
            "controller.L_r --bounds 2:3": "expected LOW:HIGH",
            "controller.L_r --bounds much": "expected LOW:HIGH",
            "controller.L_r --bounds 0:nan": "expected LOW:HIGH",
            "controller.L_r -o good.yaml --force": "is the given config",
        }.items()
    },
    **{
        f"stability good.yaml --along '{text}'": "expected KEY=FROM:TO:COUNT"
        for text in (
            "",
            "K_r",
            "K_r=1:2",
            "=1:2:3",
            "K_r=x0:x1:3",
            "K_r=x1:2:3",
            "K_r=1:inf:3",
            "K_r=1:nan:3",
            "K_r=1:2:0",
        )
    },
    **{
        f"stability good.yaml --along {key}=1:2:3": f"{key} has no numbers that can be varied "
        f"({expected}"
        for key, expected in {
            "controller.Kr": "did you mean controller.K_r?",
            "K_r": "did you mean controller.K_r?",
            "controller.K_r[3]": "did you mean controller.K_r?",
            "bdy.mass": "did you mean body.mass?",
            "body.mass.x.y": "",
            "title": "expected one of controller.K_t, controller.L_t, controller.K_r, ",
        }.items()
    },
    "stability good.yaml --along controller.K_r=1:2:3": "controller.K_r has 3 numbers "
    "(expected factors, controller.K_r=x0.5:x2:41, or one of them, controller.K_r[0]=1:20:41)",
    "stability good.yaml --along controller.K_r[0]=-1:2:3": "controller.K_r[0]: is -1",
    "stability good.yaml --along body.mass=1:2:3 --figure a.txt": "--figure a.txt: expected",
    "stability good.yaml --figure a.svg": "--along",
    "stability good.yaml --within body.mass=±1% --time-limit 0": "--time-limit",
}

WRONG_TOLERANCES = {
    "--within controller.K_r": "expected KEY=±SIZE",
    "--within initial.angular_velocity=0.1": "is not a tolerance (expected KEY=±SIZE",
    "--within initial.angular_velocity=±0.1 --within body.mass=±1": "beside other tolerances",
    "--within integration.duration=±1": "integration.duration has no numbers",
    "--within controller.K_r=±101%": "K_r[0]: at the low end of the tolerance: is -4",
    "--within controler=±1%": "--within controler=±1%:1:1: controler has no numbers that can have "
    "a tolerance (did you mean controller?)\n",
    "--largest-within --within": "needs a KEY, such as controller.K_r; --within is an o",
    "--largest-within controller.K_x": "controller.K_x has no numbers",
    "--largest-within initial.angular_velocity": "is a number of the initial state",
    "--within initial=±1% --largest-within body": "initial.angular_velocity[0]: is a number of",
    "--within controller.K_r=±1% --largest-within controller": "gives a second tolerance of "
    "controller.K_r[0] (expected one of them)\n",
    "--largest-within K_r=±5%": "--largest-within K_r=±5%:1:1: has a size, which is to be found "
    "(expected the key alone: --largest-within K_r)\n",
    "--largest-within body.mass=5": "has a size, which is to be found (expected the key alone",
    "--largest-within mass": "has no numbers that can have a tolerance (did you mean body.mass?)\n",
    "--largest-within elements": "(expected a key of body, controller, gravity, initial)\n",
    "--largest-within gravity": "is a tolerance of 0, because gravity is 0 (expected a size above",
}

USAGE = {
    **KEYS_ARE_NO_OPTIONS,
    **NO_COMMANDS,
    **WRONG_CONFIGS,
    **PLANS_AND_CONFIGS,
    **WRONG_KINDS,
    **WITHOUT_EFFECT,
    **WRONG_VALUES,
    **{f"stability good.yaml {words}": text for words, text in WRONG_TOLERANCES.items()},
}

STORAGE = {
    "show none.h5": "error: none.h5 cannot be read: No such file",
    "show empty.h5": "error: empty.h5",
    "show text.h5": "error: text.h5 has no seal of rbstab",
    "show notes.txt": "notes.txt has no seal of rbstab",
    "list none": "error: none cannot be read: No such file or directory; ",
    "list 'a b/good.yaml'": f"is a file. List the folder it is in: rbstab list {shell_word('a b')}",
    "compare results/good.h5 results/map": "results/good.h5 is a run and results/map is a sweep, "
    "which have no common outcomes",
    "compare results/map results/good.h5": "results/map is a sweep and results/good.h5 is a run",
    "report none.h5 -o r.html": "No result could be read; no report is written.",
    "report results/begun": "results/begun: is a sweep that is not finished",
    "report results/map/shards/00000000.h5": "is a part of a sweep, not a result. Name the sweep: ",
    "report results/mine": "results/mine: is a folder, but not a sweep, and no result is in it; "
    "`rbstab run CONFIG -o results/mine` stores one\n",
    "report results/good.h5 -o notes.txt": "notes.txt already exists and is not a report. Use "
    "--force to replace it.",
    "plot PROOF": "is a proof of rest states, not a result. Look at it: rbstab show ",
    "plot none.h5": "none.h5",
    "plot results/good.h5 runs-decay": "; a figure is named by --figure NAME\n",
    "plot none.h5 --figure run-1-energy -o there.csv": "there.csv",
    "plot mine.txt": "mine.txt: is a config, not a result. Run it: rbstab run mine.txt",
    "compare plan.yaml results/good.h5": "is the plan of a sweep, not a result. Run it: rbstab",
    "report 'a b/good.yaml'": "is a config, not a result. Run it: rbstab run "
    f"{shell_word(Path('a b/good.yaml'))}",
    "export none.h5 -o a.csv": "none.h5: cannot be read: No such file",
    "verify none.json": "none.json",
    **dict.fromkeys(
        ("show results/begun/shards", "show results/map/shards/00000000.h5"),
        " is a part of a sweep, not a result. Name the sweep: results/",
    ),
    "verify results/mine": "results/mine has no proof that can be checked.",
    "verify results --config good.yaml": "results has no proof of this config that can be checked.",
    "run good.yaml": "results/good.h5 holds a different result",
    "sweep --status none": "none is not the folder of a sweep: there is no such folder\n",
    "sweep --status results/mine": "results/mine is not the folder of a sweep\n",
    "init --element mine.py": "mine.py",
}


@pytest.mark.parametrize(
    "option",
    [
        option
        for option in sweep.params
        if option.name not in ("status_of", "as_json", "quiet", "plan")
    ],
    ids=str,
)
def test_a_status_has_no_use_for_the_options_of_a_sweep(option):
    (name, *_), values = option.opts, {"--set": "a=1", "--engine": "scipy"}
    value = values.get(name, "1/2" if name == "--part" else "1")
    done = ended(2, "sweep", "--status", "results/plan", name, *([] if option.is_flag else [value]))
    assert f"Error: --status cannot be combined with {name}\n" in done.stderr


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with files of every kind, right and wrong."""
    folder = tmp_path_factory.mktemp("place")
    for name, text in FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    made_file(folder / "results/good.h5")
    for name in ("map", "begun"):
        whole = {"map": "finished_map", "begun": "begun_map"}[name]
        shutil.copytree(STORED / "sweeps" / whole, folder / "results" / name)
    for name in ("embedded", "range_left"):
        store_proof_of(STORED / f"runs/{name}.h5", folder / "results")
    return folder


def contents(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize(
    ("line", "code", "message"),
    [
        *((line, 2, text) for line, text in USAGE.items()),
        *((line, 4, text) for line, text in STORAGE.items()),
    ],
)
@pytest.mark.usefixtures("no_runs")
def test_a_command_that_cannot_be_done_says_why_and_changes_nothing(
    line, code, message, place, monkeypatch
):
    monkeypatch.chdir(place)
    before = contents(place)
    first, second = map(str, sorted(Path("results/proofs").iterdir()))
    done = rbstab(*shlex.split(line.replace("PROOF2", second).replace("PROOF", first)))
    assert done.exit_code == code, done.output
    assert printed(message) in done.stderr or message in done.stderr
    assert done.stdout == ""
    # What a message names, it names once.
    assert done.stderr.count(message) <= 1 or message == " "
    assert contents(place) == before
