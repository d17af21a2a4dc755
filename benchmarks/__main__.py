"""`make bench`: all benchmarks, one after the other."""

from benchmarks import engines, sliding, startup

startup.main()
engines.main()
sliding.main()
