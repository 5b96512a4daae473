"""The script `sgrt`.

A package of its own, because it must speak before numpy is imported: numpy's BLAS would start a thread a core, and a
process must not have more threads than `--threads` grants.
"""

import os


def main() -> int:
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from sgrt.cli import main as command

    return command()
