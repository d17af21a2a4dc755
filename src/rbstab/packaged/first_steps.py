"""The files of a new user: a config, a plan of a sweep, and a page on what to try with them."""

from rbstab.packaged.first_config import CONNECTIONS, first_config

CONFIG_FILE = "experiment.yaml"
PLAN_FILE = "sweep.yaml"
PAGE_FILE = "README.md"

_PLAN = """\
# A sweep: the experiment beside it, run once for each pair of the initial spins below.
title: How fast may it spin?
base: experiment.yaml
vary:
  initial.angular_velocity[0]: {linspace: [-20, 20, 15]}    # rad/s: from, to, how many
  initial.angular_velocity[1]: {linspace: [-20, 20, 15]}    # rad/s
design: grid                            # every combination: 15 x 15 = 225 members
"""

_PAGE = """\
# My first experiment

`experiment.yaml` describes one rigid body, what acts on it, and how it starts.
Its variant is `{variant}`: {connection}.
`sweep.yaml` varies two of its numbers.

## Run it

```console
$ rbstab run experiment.yaml
$ rbstab show results/experiment.h5
$ rbstab report results/experiment.h5
```

`run` integrates the motion, stores it in `results/experiment.h5`, and proves what it can within
some seconds: whether this motion comes to rest, and whether all others do. `show` prints what was
found. `report` writes `results/report.html`, a page with figures of the motion; `--open` opens it
in the browser.

## Is it stable?

```console
$ rbstab stability experiment.yaml
```

This prints all states in which the body can rest, and from which starts it is proved to come to
rest. Where nothing can be proved, the output says why.

## Change something

Edit `experiment.yaml`, or replace single values on the command line. Results are never overwritten
by different ones, so give another folder:

```console
$ rbstab run experiment.yaml --set "controller.K_r=[40,40,32]" -o softer
$ rbstab run experiment.yaml --set "initial.angular_velocity=[16,32,-16]" -o faster
$ rbstab run experiment.yaml --set "gravity=[0,0,-9.81]" -o heavy
$ rbstab report results/experiment.h5 softer/experiment.h5 faster/experiment.h5 heavy/experiment.h5
```

`rbstab check experiment.yaml` lists what is wrong in a config, with line and column.

## Look at the results

```console
$ rbstab list
$ rbstab compare results/experiment.h5 softer/experiment.h5
$ rbstab plot results
$ rbstab plot results --figure run-1-energy -o energy.csv
```

`list` names the runs and sweeps in `results`. `compare` prints what differs between two of them.
`plot` lists the figures of the report, and writes one of them: a drawing for a paper (`.svg`,
`.pdf`, `.png`) or its data (`.csv`).

## Many runs at once

```console
$ rbstab sweep sweep.yaml
$ rbstab report results/sweep -o results/sweep.html
```

The report has a map of the outcomes. `rbstab run sweep.yaml --member 17` runs one member by itself.

## More

`rbstab --help` lists all commands. `rbstab examples` lists ready configs and plans, and copies
them.
`rbstab schema > rbstab.schema.json` writes a file with which editors complete and check configs.
"""


def first_files(variant: str) -> dict[str, str]:
    """Return the texts of the first files of a new user, by their names.

    Raises:
        KeyError: There is no such variant.
    """
    config = first_config(variant)
    connection = CONNECTIONS.get(variant, "a connector acts at its contact point C")
    page = _PAGE.format(variant=variant, connection=connection)
    return {CONFIG_FILE: config, PLAN_FILE: _PLAN, PAGE_FILE: page}
