"""Ours beside its peers: .venv/bin/python benchmarks/run.py [--only NAME ...] [--json] [--threads N] [--repeats N]

A row: work, ours_ms, peer, peer_ms, ratio (peer_ms / ours_ms: how many times as fast ours is), ours_error, peer_error,
unit, threads. Times are medians of calls made alternately in one run; errors are against the truth of the made scene.
The first run makes the virtual environment of the peers, .venv-peers.
"""

import argparse
import importlib
import json
import sys
import tempfile
from pathlib import Path

NAMES = ("icp", "stereo", "project", "nurbs", "nurbs_fit", "calibration", "filter", "tof", "laser")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=NAMES, default=NAMES, metavar="NAME", help=", ".join(NAMES))
    parser.add_argument("--json", action="store_true", help="one JSON document, a list of rows")
    parser.add_argument("--threads", type=int, default=1, help="of ours and of each peer (1)")
    parser.add_argument("--repeats", type=int, default=7, help="calls of each that the median is taken of (7)")
    arguments = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name in arguments.only:
            for row in importlib.import_module(name).rows(Path(folder), arguments.repeats, arguments.threads):
                rows.append(row)
                if not arguments.json:
                    print(line_of(row), flush=True)
    if arguments.json:
        json.dump(rows, sys.stdout, indent=1)
        print()


def line_of(row: dict) -> str:
    return (
        f"{row['work']:44} ours {row['ours_ms']:>8} ms  {row['peer']:24} {row['peer_ms']:>8} ms  x{row['ratio']:<7}"
        f" error {row['ours_error']} against {row['peer_error']} {row['unit']}, {row['threads']} thread(s)"
    )


if __name__ == "__main__":
    main()
