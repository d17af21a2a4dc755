"""`make bench`: all benchmarks, one after the other."""

from benchmarks import engines, startup

startup.main()
engines.main()
