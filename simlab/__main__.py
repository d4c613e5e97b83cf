"""`python -m simlab`: the laboratory in a process of its own, until its standard input closes."""

import argparse
import json
import sys
from dataclasses import asdict

from simlab.case.draw import CaseKind, draw_case
from simlab.laboratory import Laboratory


def main() -> None:
    """Start, print the addresses as one line of JSON, and stay until the other end lets go."""
    parser = argparse.ArgumentParser(prog="python -m simlab", description="simulated laboratory")
    parser.add_argument("--seed", type=int, default=1, help="which bench is drawn")
    parser.add_argument("--speed", type=float, default=1.0, help="bench time over wall time")
    parser.add_argument("--case", type=CaseKind, help="stand in for the ordinary bench: none, single, pair, novel")
    parser.add_argument("--effect", action="append", default=[], help="effect of the case, in place of a drawn one")
    arguments = parser.parse_args()
    case = draw_case(arguments.seed, arguments.case, arguments.effect) if arguments.case else None
    with Laboratory(arguments.seed, arguments.speed, case=case) as laboratory:
        print(json.dumps(asdict(laboratory.addresses)), flush=True)
        sys.stdin.read()


if __name__ == "__main__":
    main()
