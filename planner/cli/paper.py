"""The work of `planner experiment paper`: all experiments of the paper and one report."""

import argparse
from pathlib import Path

from planner.cli.batch import (
    chosen_experiment,
    list_conditions,
    results_folder,
    run_experiments,
)
from planner.cli.printing import print_result
from planner.paper.claims import verdicts_table
from planner.paper.experiments import EXPERIMENTS
from planner.paper.report import claims_of, write_report
from planner.report.experiment_tables import failures


def run_paper(arguments: argparse.Namespace) -> int:
    """Run all experiments of the paper and write one report, or list their conditions."""
    chosen = {name: chosen_experiment(arguments, name) for name in EXPERIMENTS}
    conditions = {name: one.conditions() for name, one in chosen.items()}
    if arguments.dry_run:
        stems = {Path(one.path.stem): conditions[name] for name, one in chosen.items()}
        return list_conditions(arguments, stems)
    out = results_folder(arguments)
    parts = {out / one.path.stem: one for one in chosen.values()}
    waiting = dict(zip(parts, conditions.values(), strict=True))
    results = run_experiments(arguments, parts, waiting, "paper")
    found = {folder.name: of_one for folder, of_one in results.items()}
    claims = claims_of(found)
    page = write_report(out, found, claims, quick=arguments.quick)
    failed = [line for one in found.values() for line in failures(one.rows)]
    summary = {
        "report": str(page),
        "conditions": sum(map(len, conditions.values())),
        "run": sum(one.run for one in found.values()),
        "failed": sum(row["reason"] is not None for one in found.values() for row in one.rows),
        "claims": {claim.text: claim.verdict for claim in claims},
    }
    print_result(arguments, summary, [verdicts_table(claims), *failed, f"written to {page}"])
    return 0
