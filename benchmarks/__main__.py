"""`make bench`: all benchmarks, one after the other."""

from benchmarks import engines, sliding, startup, sweeps, traces

startup.main()
engines.main()
sliding.main()
sweeps.main()
traces.main()
