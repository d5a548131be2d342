"""The paper's claims, each held against what experiments found."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from planner.experiments.run import Results

if TYPE_CHECKING:
    from rich.table import Table

Verdict = Literal["reproduced", "in part", "not reproduced", "beyond the paper"]
ResultsByName = Mapping[str, Results]  # by the name of the experiment


@dataclass(frozen=True)
class Claim:
    """A claim of the paper, or a question that it leaves, and what is found of it."""

    text: str  # the paper's own words, or the question
    where: str  # in the paper
    interpretation: str  # under which it was tested
    verdict: Verdict
    finding: str  # by how much, with interval
    table: str = ""  # in Markdown, where one number is not enough
    note: str = ""  # beside the verdict: how far it holds


Judge = Callable[[ResultsByName], Iterable[Claim]]


def judged(found: ResultsByName, judges: Sequence[Judge]) -> list[Claim]:
    """Return the claims that the experiments at hand can say something of."""
    return [claim for judge in judges for claim in judge(found)]


def markdown_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table; numbers stand to the right, the first column to the left."""
    lines = ["| " + " | ".join(header) + " |"]
    lines.append("|---|" + "--:|" * (len(header) - 1))
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines)


def page(claims: Sequence[Claim]) -> str:
    """Return the claims as Markdown: a table of verdicts, then each in full."""
    short = [
        (f"[{number}](#claim-{number}) {claim.text}", claim.where, _verdict(claim))
        for number, claim in enumerate(claims, 1)
    ]
    table = "| claim | in the paper | |\n|---|---|---|\n" + "\n".join(
        f"| {text} | {where} | {verdict} |" for text, where, verdict in short
    )
    full = [_full(number, claim) for number, claim in enumerate(claims, 1)]
    return "\n\n".join([table, *full]) + "\n"


def verdicts_table(claims: Sequence[Claim]) -> "Table":
    """Return the claims and their verdicts for a terminal."""
    from rich import box
    from rich.table import Table

    table = Table(title="the paper's claims", box=box.SIMPLE_HEAD, title_justify="left")
    for name in ("claim", "in the paper", "verdict"):
        table.add_column(name)
    for claim in claims:
        table.add_row(claim.text, claim.where, _verdict(claim, mark=""))
    return table


def _verdict(claim: Claim, *, mark: str = "**") -> str:
    return f"{mark}{claim.verdict}{mark}" + f": {claim.note}" * bool(claim.note)


def _full(number: int, claim: Claim) -> str:
    parts = [
        f'<a id="claim-{number}"></a>\n\n### {number}. {claim.text}',
        f"*{claim.where}.* **{claim.verdict.capitalize()}.** {claim.finding}",
        f"Interpretation: {claim.interpretation}.",
        claim.table,
    ]
    return "\n\n".join(part for part in parts if part)
