"""All benchmarks, one after the other; `make bench` runs them.

With a commit, as in `make bench BEFORE=COMMIT`: what they have in common, side by side.
"""

import sys

from benchmarks import (
    against,
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

if len(sys.argv) > 1:
    against.main(sys.argv[1])
else:
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
