"""Measure cases, draw them, and write the page; prints, as JSON, what was measured and what was left out.

python -m surgisim.verification [NAME ...] --out docs/verification
"""

import argparse
import json
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

from surgisim.problem import Problem
from surgisim.verification.cases import Absent, absence, choose
from surgisim.verification.page import assemble, run


def main() -> int:
    arguments = _arguments()
    try:
        chosen = choose(arguments.case)
    except Problem as problem:
        print(problem, file=sys.stderr)
        return 2
    measured, left_out = {}, {}
    for name, case in {} if arguments.only_page else chosen.items():
        reason = absence(case)
        if reason is None:
            try:
                measured[name] = round(run(name, arguments.out, quick=arguments.quick, progress=_tell(name)), 1)
            except Absent as absent:
                reason = str(absent)
        if reason is not None:
            left_out[name] = reason
    page = arguments.page or arguments.out.with_suffix(".md")
    shown = [] if arguments.no_page else assemble(arguments.out, page)
    print(json.dumps({"seconds": measured, "left_out": left_out, "on_page": shown}, indent=1))
    return 0


def _arguments() -> argparse.Namespace:
    cli = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    cli.add_argument("case", nargs="*", metavar="NAME", help="cases to measure (default: all)")
    cli.add_argument("--out", type=Path, default=Path("docs/verification"), help="folder of NAME.json and NAME.png")
    cli.add_argument("--page", type=Path, help="the page (default: the folder's name with .md)")
    cli.add_argument("--quick", action="store_true", help="the small versions that tests run")
    only = cli.add_mutually_exclusive_group()
    only.add_argument("--only-page", action="store_true", help="measure nothing, write the page from what is there")
    only.add_argument("--no-page", action="store_true", help="measure only, as one job of several does")
    return cli.parse_args()


def _tell(name: str):
    def tell(done: float, total: float, text: str) -> None:
        print(f"{name}: {done:g}/{total:g} {text}", file=sys.stderr, flush=True)

    return tell


if __name__ == "__main__":
    sys.exit(main())
