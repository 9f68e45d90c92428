"""The command: print the outcome of all cases; the exit code is 1 if any case fails."""

from __future__ import annotations

import argparse
import sys
from collections import Counter

from tests.fuzz.cases import Case, acts_of, content_of
from tests.fuzz.warm_up import warm_up
from tests.fuzz.workers import MEGABYTES, SECONDS, Outcome, outcomes


def main() -> int:
    """Run all cases and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--files", type=int, default=5000)
    parser.add_argument("--arguments", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--only", type=int, help="the number of one case")
    given = parser.parse_args()
    warm_up()
    bad = 0
    for kind, n in (("file", given.files), ("arguments", given.arguments)):
        numbers = [given.only] if given.only is not None else range(n)
        cases = [Case(kind, k, given.seed) for k in numbers][: n or None] if n else []
        bad += _told(kind, _run(cases, given.workers))
    return 1 if bad else 0


def _run(cases: list[Case], n_workers: int) -> list[Outcome]:
    done = []
    for outcome in outcomes(cases, acts_of, n_workers):
        done.append(outcome)
        if outcome.bad:
            print(_line(outcome), flush=True)
    return done


def _line(o: Outcome) -> str:
    name = content_of(o.case)[0] if o.case.kind == "file" else ""
    took = f"{o.seconds:.2f} s ({o.slowest}), {o.megabytes:.0f} MiB"
    faults = "".join(f"\n    {fault}" for fault in sorted(set(o.faults))[:6])
    return f"  {o.case.kind} {o.case.number} {name}: {took}{faults}"


def _told(kind: str, done: list[Outcome]) -> int:
    if not done:
        return 0
    slow, large = max(done, key=lambda o: o.seconds), max(done, key=lambda o: o.megabytes)
    counts = {
        "cases": len(done),
        "acts with a result": sum(o.results for o in done),
        "acts refused with CCWSIMError": sum(o.refusals for o in done),
        "cases with a result": sum(o.results > 0 for o in done),
        "cases with other exceptions": sum(bool(o.faults) for o in done),
        f"cases over {SECONDS:g} s": sum(o.seconds > SECONDS for o in done),
        f"cases over {MEGABYTES:g} MiB": sum(o.megabytes > MEGABYTES for o in done),
    }
    print(f"{kind}:")
    for name, count in counts.items():
        print(f"  {name}: {count}")
    print(f"  slowest: {_line(slow).strip()}")
    print(f"  largest: {_line(large).strip()}")
    for fault, n in Counter(f.split(" at ")[-1] for o in done for f in o.faults).most_common(40):
        print(f"  {n} times: {fault}")
    return sum(o.bad for o in done)


if __name__ == "__main__":
    sys.exit(main())
