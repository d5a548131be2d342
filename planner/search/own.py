"""A planner of the user's own: a function in a Python file, by the file's path and its name."""

import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from inspect import signature
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from planner.errors import InputError, NotApplicableError
from planner.guard import read_text
from planner.messages import suggestion
from planner.provenance import sha256_of_file
from planner.search.problem import Budget, Problem
from planner.search.result import SearchResult
from planner.search.sound import fault_of

ASKED = "def {name}(problem, budget, rng)"


@dataclass(frozen=True)
class OwnPlanner:
    """A function that plans, and the file that it stands in."""

    file: str  # the file's name, without its folder
    function: str
    sha256: str  # of the file
    path: Path = field(compare=False)  # where it lies here; elsewhere it is still the same planner

    @property
    def name(self) -> str:
        """What tables and plans call it: ``nearest.py:nearest``."""
        return f"{self.file}:{self.function}"

    def as_dict(self) -> dict[str, str]:
        """Return which planner it is as plain data, the same wherever the file lies."""
        return {"file": self.file, "function": self.function, "sha256": self.sha256}

    def load(self) -> Callable[..., SearchResult]:
        """Return the function, whose every fault is told in one line that names it.

        Raises
        ------
        InputError
            If the file has changed, cannot be run, or has no such function.
        """
        function = _function(self, _module(self))

        def own(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:
            made: SearchResult = _called(self, function, problem, budget, rng)
            fault = fault_of(problem, made)
            if fault is not None:
                raise InputError(f"{self.name}: {fault}")
            return replace(made, plan=replace(made.plan, method=self.name))

        return own


def own_planner(text: str, folder: Path = Path()) -> OwnPlanner:
    """Return the planner of ``path.py:function``; a path that is relative is so to a folder.

    Raises
    ------
    InputError
        If the file cannot be read, or the function has no name that could be one.
    """
    file, _, function = text.rpartition(":")
    path = folder / file
    if not path.suffix == ".py" or not function.isidentifier():
        raise InputError(f"method {text!r}: should be path.py:function")
    read_text(path)  # as the one door says what is wrong with a file
    return OwnPlanner(path.name, function, sha256_of_file(path), path)


def _module(own: OwnPlanner) -> ModuleType:
    """Return a planner's file as a module; files beside it can be imported from it."""
    name = f"planner_own_{own.sha256[:16]}"
    if name in sys.modules:
        return sys.modules[name]
    content = read_text(own.path)
    if sha256_of_file(own.path) != own.sha256:
        raise InputError(f"{own.path}: has changed since it was asked for; start again")
    module = ModuleType(name)
    module.__file__ = str(own.path)
    beside = str(own.path.parent.resolve())
    if beside not in sys.path:
        sys.path.append(beside)  # at the end, where it hides nothing
    sys.modules[name] = module  # dataclasses look for the module that they stand in
    try:
        exec(compile(content, str(own.path), "exec"), module.__dict__)
    except SyntaxError as error:
        del sys.modules[name]
        raise InputError(
            f"{own.path}: line {error.lineno}: is not Python ({error.msg}); correct it there"
        ) from error
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        raise InputError(f"{own.path}: cannot be loaded: {_told(own, error)}") from error
    return module


def _function(own: OwnPlanner, module: ModuleType) -> Callable[..., Any]:
    function = vars(module).get(own.function)
    asked = ASKED.format(name=own.function)
    if function is None:
        names = [k for k, v in vars(module).items() if callable(v) and not k.startswith("_")]
        here = [k for k in names if getattr(vars(module)[k], "__module__", "") == module.__name__]
        remedy = suggestion(own.function, here) if here else f"write {asked}"
        raise InputError(f"{own.path}: has no function {own.function!r}; {remedy}")
    if not callable(function):
        raise InputError(f"{own.path}: {own.function} is no function; write {asked}")
    try:
        signature(function).bind(None, budget=None, rng=None)
    except (TypeError, ValueError) as error:
        raise InputError(f"{own.path}: {own.function}: {error}; write {asked}") from error
    return function  # type: ignore[no-any-return]


def _called(
    own: OwnPlanner,
    function: Callable[..., Any],
    problem: Problem,
    budget: Budget,
    rng: np.random.Generator,
) -> Any:
    try:
        return function(problem, budget=budget, rng=rng)
    except (NotApplicableError, MemoryError):
        raise
    except (Exception, SystemExit) as error:
        raise InputError(f"{own.name}: raised {_told(own, error)}") from error


def _told(own: OwnPlanner, error: BaseException) -> str:
    """Return an error in one line, with the last line of the planner's file on its way."""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [frame.lineno for frame in frames if frame.filename == str(own.path)]
    where = f" (line {lines[-1]} of {own.file})" if lines else ""
    said = " ".join(str(error).split())
    return f"{type(error).__name__}{': ' * bool(said)}{said}{where}"
