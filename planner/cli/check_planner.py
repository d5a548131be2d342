"""`planner check-planner`: whether a planner of the user's own keeps the contract of planners."""

import argparse
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from planner.cli.printing import print_result
from planner.messages import counted

if TYPE_CHECKING:
    from planner.search.contract import Breach
    from planner.user_code import UserFunction

SUMMARY = "hold a planner of your own against what every planner owes"
DETAILS = """\
The planner is a function (problem, budget, rng) in a Python file. It plans for
six small problems; what it breaks is told with a remedy, and the exit code is
then 1."""
EXAMPLES = (
    ("check-planner mine.py:nearest", "does it keep the contract?"),
    ("check-planner mine.py:nearest --json", "the same for programs"),
)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner check-planner`."""
    parser.add_argument("planner", metavar="FILE.py:FUNCTION", help="the file, and the function")


def run(arguments: argparse.Namespace) -> int:
    """Check a planner and tell what it breaks: 0 if nothing, 1 if anything."""
    from planner.search.contract import breaches
    from planner.search.own import loaded
    from planner.user_code import UserFunction

    own = UserFunction.of(arguments.planner)
    found = [*breaches(loaded(own))]
    is_broken = any(one.clause is not None and not one.clause.is_advice for one in found)
    kept_out = sum(one.clause is None for one in found)
    summary = {
        "planner": own.as_dict(),
        "keeps_the_contract": not is_broken,
        "found": [_plain(one) for one in found],
    }
    print_result(arguments, summary, _blocks(own, found, is_broken=is_broken, refused=kept_out))
    return int(is_broken)


def _plain(one: "Breach") -> dict[str, Any]:
    clause = one.clause
    return {
        "problem": one.problem,
        "clause": clause and clause.name,
        "is_advice": clause is None or clause.is_advice,
        "told": one.said,
        "remedy": one.remedy,
    }


def _blocks(
    own: "UserFunction", found: "list[Breach]", *, is_broken: bool, refused: int
) -> Iterator[str]:
    """Yield a paragraph for each clause that is broken, on whatever problems, and the verdict."""
    from planner.search.contract import CLAUSES
    from planner.search.contract_problems import PROBLEMS

    for clause in CLAUSES:
        broken = [one for one in found if one.clause is clause]
        if broken:
            yield f"{'advice' if clause.is_advice else 'broken'}: {clause.name}"
            for said in dict.fromkeys(one.said for one in broken):
                where = [one.problem for one in broken if one.said == said]
                on = "all problems" if len(where) == len(PROBLEMS) else ", ".join(where)
                yield f"  {on}: {said.removeprefix(f'{own.name}: ')}"
            for remedy in {one.remedy for one in broken} - {None}:
                yield f"  remedy: {remedy}"
    for one in found:
        if one.clause is None:
            yield f"not applicable: {one.problem}: {one.said}"
    problems = counted(len(PROBLEMS) - refused, "problem")
    verdict = "does not keep the contract" if is_broken else f"keeps the contract on {problems}"
    yield f"{own.name} {verdict} (SHA-256 {own.sha256[:16]}...)"
    if not is_broken:
        yield f"try it: planner compare grid5x5 --method {own.path}:{own.function}"
