"""All benchmarks, one after the other; `make bench` runs them."""

from benchmarks import (
    commands,
    elements,
    engines,
    limit,
    reports,
    sliding,
    startup,
    sweep_sizes,
    sweeps,
    traces,
)

startup.main()
commands.main()
engines.main()
elements.main()
sliding.main()
sweeps.main()
limit.main()
reports.main()
sweep_sizes.main()
traces.main()
