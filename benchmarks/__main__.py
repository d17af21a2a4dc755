"""All benchmarks, one after the other; `make bench` runs them."""

from benchmarks import commands, elements, engines, sliding, startup, sweep_sizes, sweeps, traces

startup.main()
commands.main()
engines.main()
elements.main()
sliding.main()
sweeps.main()
sweep_sizes.main()
traces.main()
