"""A user's own planner: found, told apart, and every fault of it told in one line."""

import re
from pathlib import Path

import numpy as np
import pytest

from planner.errors import InputError, NotApplicableError
from planner.search.contract import BUDGET, CLAUSES, breaches
from planner.search.contract_problems import PROBLEMS
from planner.search.methods import method_named
from planner.search.own import loaded
from planner.search.result import SearchResult
from planner.user_code import UserFunction

HEAD = """\
import numpy as np
import planner
from dataclasses import replace
from planner import SearchResult, Track, Plan, plan_of_legs
"""
FAULTS = {
    "def f(:\n  pass": r"mine.py: line 5: is not Python \(",
    "1 / 0": r"cannot be loaded: ZeroDivisionError: division by zero \(line 5 of mine.py\)",
    "import sys; sys.exit(3)": r"cannot be loaded: SystemExit: 3 \(line 5",
    "import no_such_module_x": "cannot be loaded: ModuleNotFoundError: No module named",
    "def g(problem, budget, rng): ...": "has no function 'f'; known: g",
    "x = 3": r"has no function 'f'; write def f\(problem, budget, rng\)",
    "f = 3": r"f is no function; write def f\(problem, budget, rng\)",
    "def f(problem): ...": r"f: got an unexpected keyword argument 'budget'; write def f\(",
}
NONSENSE = {
    "return None": "mine.py:f: returned None, no SearchResult; return SearchResult(plan)",
    "return plan_of_legs(problem, 'x', [0])": "returned a Plan, no SearchResult",
    "raise GeneratorExit": "mine.py:f: raised GeneratorExit (line 6",
    "raise type('Odd', (Exception,), {'__str__': None})": "mine.py:f: raised Odd (line 6",
    "r = SearchResult(plan_of_legs(problem, 'x', [0])); "
    "object.__setattr__(problem.sensor, 'radius_m', 1e6); return r": "changed the problem; copy",
    "return SearchResult(7)": "returned a SearchResult of an int, no Plan",
    "return {}['x']": "mine.py:f: raised KeyError: 'x' (line 6 of mine.py)",
    "return SearchResult(plan_of_legs(problem, 'x', [999]))": "mine.py:f: raised InputError: order",
    "p = plan_of_legs(problem, 'x', [0]); return SearchResult(replace(p, tracks=()))": (
        "returned 0 tracks and 1 lists of legs for one UAV"
    ),
    "return flies([0, 1], [-30e3, 50e3], [0, 0])": "faster than the UAV's 100 m/s",
    "return flies([0, 900], [0, 5e3], [0, 0])": "begins at 0.0, 0.0 m at 0.0 s, but the search",
    "return flies([0, 900], [-30e3, 5e3], [0, 0], [[-5, 9]])": "sensor on before or after",
    "p = plan_of_legs(problem, 'x', [0]); l = replace(p.legs[0][0], leg=99); "
    "return SearchResult(replace(p, legs=((l,),)))": "names a leg that is not there",
    "p = plan_of_legs(problem, 'x', [0]); l = replace(p.legs[0][0], end_s=1e6); "
    "return SearchResult(replace(p, legs=((l,),)))": "flies leg 0 outside of its own track",
}
FLIES = """
def flies(t, x, y, on=()):
    track = Track(np.array(t, float), np.array(x, float), np.array(y, float),
                  np.array(on, float).reshape(-1, 2))
    return SearchResult(Plan("x", (track,), ((),)))
"""
BREAKS = {  # what a planner does, and the clause that it breaks
    "order = np.random.permutation(4)": "the same stream gives the same plan",
    "order = problem.futures.weight.argsort()[:1]; calls.append(1); order = [len(calls) % 8]": (
        "the same stream gives the same plan"
    ),
    "problem = problem.replace(start=None); order = [0]": "a search that has begun is gone on with",
    "order = [0]; problem.futures.__dict__['weight'] = problem.futures.weight / 2": (
        "the problem is left as it is"
    ),
}


def written(folder: Path, text: str) -> str:
    (folder / "mine.py").write_text(HEAD + text)
    return f"{folder / 'mine.py'}:f"


def test_it_is_a_method_by_its_file_and_its_digest(tmp_path: Path) -> None:
    text = written(tmp_path, "def f(problem, budget, rng):\n    return SearchResult(g(problem))\n"
                   "from beside import g")  # fmt: skip
    (tmp_path / "beside.py").write_text(
        "import planner\ndef g(problem): return planner.plan_of_legs(problem, 'x', [0])"
    )
    method = method_named(text)
    assert (method.name, method.chooses, method.stops) == ("mine.py:f", True, True)
    problem = PROBLEMS["paper_figure3"]()
    made = method.load()(problem, budget=BUDGET, rng=np.random.default_rng(1))
    assert isinstance(made, SearchResult)
    assert made.plan.method == "mine.py:f"
    own = UserFunction.of("mine.py:f", tmp_path)
    assert own == method.own
    assert str(tmp_path) not in repr(own.as_dict())
    written(tmp_path, "def f(problem, budget, rng): return None")
    assert UserFunction.of(text) != own
    assert loaded(UserFunction.of(text)) is not None
    (tmp_path / "mine.py").write_text("# another one")
    with pytest.raises(InputError, match="has changed since it was asked for"):
        loaded(UserFunction("mine.py", "f", "0" * 64, tmp_path / "mine.py"))


@pytest.mark.parametrize("text", FAULTS)
def test_a_faulty_file_is_told_in_one_line(tmp_path: Path, text: str) -> None:
    named = written(tmp_path, text)
    with pytest.raises(InputError, match=FAULTS[text]):
        method_named(named).load()


@pytest.mark.parametrize(
    ("named", "told"),
    [
        ("nowhere.py:f", "nowhere.py: "),
        ("a.py:", "should be path.py:function"),
        ("a.py:f:g", "should be path.py:function"),
        ("a.txt:f", "is unknown; choose one of .* path.py:function"),
    ],
)
def test_a_name_that_is_none(named: str, told: str) -> None:
    with pytest.raises(InputError, match=told):
        method_named(named)


@pytest.mark.parametrize("body", NONSENSE)
def test_nonsense_is_named(tmp_path: Path, body: str) -> None:
    text = f"def f(problem, budget, rng):\n    {body}\n{FLIES}"
    planner = method_named(written(tmp_path, text)).load()
    with pytest.raises(InputError, match=re.escape(NONSENSE[body])):
        planner(PROBLEMS["paper_figure3"](), budget=BUDGET, rng=np.random.default_rng(1))


def test_a_reason_not_to_plan_is_one(tmp_path: Path) -> None:
    text = "def f(problem, budget, rng): raise planner.NotApplicableError('no')"
    planner = method_named(written(tmp_path, text)).load()
    with pytest.raises(NotApplicableError, match=r"^no$"):
        planner(PROBLEMS["two_way"](), budget=BUDGET, rng=np.random.default_rng(1))
    found = [*breaches(planner)]
    assert {one.problem for one in found} == set(PROBLEMS)
    assert {(one.clause, one.said) for one in found} == {(None, "no")}


@pytest.mark.parametrize("body", BREAKS)
def test_a_broken_clause_is_found(tmp_path: Path, body: str) -> None:
    text = (
        f"calls = []\ndef f(problem, budget, rng):\n    given = problem\n    {body}\n"
        "    return SearchResult(plan_of_legs(problem, 'x', list(map(int, order))))"
    )
    planner = method_named(written(tmp_path, text)).load()
    found = [*breaches(planner, {"paper_figure3": PROBLEMS["paper_figure3"]})]
    assert BREAKS[body] in [one.clause.name for one in found if one.clause]


def test_the_problems_differ_in_what_planners_get_wrong() -> None:
    problems = [make() for make in PROBLEMS.values()]
    assert len({clause.name for clause in CLAUSES}) == len(CLAUSES)
    for tell in (
        lambda p: p.sensor.detects_in_transit,
        lambda p: p.objective.by_s is None,
        lambda p: p.uav.return_to_m is None,
        lambda p: p.futures.gone.any(),
    ):
        assert {bool(tell(problem)) for problem in problems} == {True, False}
