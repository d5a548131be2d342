"""A function in a Python file of the user's: which one it is, and its faults in one line each."""

import hashlib
import importlib.util
import sys
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from inspect import signature
from pathlib import Path
from types import ModuleType
from typing import Any

from planner.errors import InputError
from planner.guard import read_text
from planner.messages import suggestion

FORM = "should be path.py:function"
OR_MODULE = f"{FORM}, or module:function of a module in this folder or in Python's path"


@dataclass(frozen=True)
class UserFunction:
    """A function, and the file that it stands in."""

    file: str  # the file's name, without its folder
    function: str
    sha256: str  # of the file's text
    path: Path = field(compare=False)  # where it lies here; elsewhere it is still the same one

    @classmethod
    def of(cls, text: str, folder: Path = Path()) -> "UserFunction":
        """Return the one written as ``path.py:function``, a path that begins from a folder.

        Raises
        ------
        InputError
            If the file cannot be read, or the function has no name that could be one.
        """
        file, _, function = text.rpartition(":")
        path = folder / file
        if path.suffix != ".py" or not function.isidentifier():
            raise InputError(f"{text!r}: {FORM}")
        return cls(path.name, function, _sha256(read_text(path)), path)

    @classmethod
    def named(cls, text: str) -> "UserFunction":
        """Return the one written as ``path.py:function``, or as ``module:function``.

        A module lies in this folder or in Python's path.

        Raises
        ------
        InputError
            If there is no such file or module, or the function has no name that could be one.
        """
        place, _, function = text.rpartition(":")
        if place.endswith(".py"):
            return cls.of(text)
        if not all(name.isidentifier() for name in (*place.split("."), function)):
            raise InputError(f"{text!r}: {OR_MODULE}")
        return cls.of(f"{_file_of(place)}:{function}")

    @property
    def name(self) -> str:
        """What it is called in tables and files: ``mine.py:function``."""
        return f"{self.file}:{self.function}"

    def as_dict(self) -> dict[str, str]:
        """Return which one it is as plain data, the same wherever the file lies."""
        return {"file": self.file, "function": self.function, "sha256": self.sha256}

    def load(self, asked: str, *args: Any, **kwargs: Any) -> Callable[..., Any]:
        """Return the function.

        Parameters
        ----------
        asked
            How its ``def`` should look, for whoever has to write one.
        args, kwargs
            What it will be called with, or stand-ins: it has to take as many and these names.

        Raises
        ------
        InputError
            If the file has changed or cannot be run, or it holds no such function.
        """
        module = self._module()
        function = vars(module).get(self.function)
        if function is None:
            own = [name for name, thing in vars(module).items() if _is_of(thing, module)]
            remedy = suggestion(self.function, own) if own else f"write {asked}"
            raise InputError(f"{self.path}: has no function {self.function!r}; {remedy}")
        if not callable(function):
            raise InputError(f"{self.path}: {self.function} is no function; write {asked}")
        try:
            signature(function).bind(*args, **kwargs)
        except (TypeError, ValueError) as error:
            raise InputError(f"{self.path}: {self.function}: {error}; write {asked}") from error
        return function  # type: ignore[no-any-return]

    def forget(self) -> None:
        """Have the file run anew when the function is loaded next: what it has kept is lost."""
        sys.modules.pop(self._module_name, None)

    def said(self, error: BaseException) -> str:
        """Return an exception in one line, with the last line of the file on its way."""
        frames = traceback.extract_tb(error.__traceback__)
        lines = [frame.lineno for frame in frames if frame.filename == str(self.path)]
        where = f" (line {lines[-1]} of {self.file})" if lines else ""
        text = ""
        with suppress(Exception):  # words are the exception's own to make
            text = " ".join(str(error).split()).rstrip(".")
        return f"{type(error).__name__}{': ' * bool(text)}{text}{where}"

    @property
    def _module_name(self) -> str:
        return f"planner_user_{self.sha256[:16]}"

    def _module(self) -> ModuleType:
        """Return the file as a module, run once; files beside it can be imported from it."""
        name = self._module_name
        if name in sys.modules:
            return sys.modules[name]
        text = read_text(self.path)
        if _sha256(text) != self.sha256:
            raise InputError(f"{self.path}: has changed since it was asked for; start again")
        module = ModuleType(name)
        module.__file__ = str(self.path)
        _look_in(self.path.parent)
        sys.modules[name] = module  # dataclasses look for the module that they stand in
        try:
            exec(compile(text, str(self.path), "exec"), module.__dict__)
        except SyntaxError as error:
            del sys.modules[name]
            raise InputError(
                f"{self.path}: line {error.lineno}: is not Python ({error.msg}); correct it there"
            ) from error
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            del sys.modules[name]
            raise InputError(f"{self.path}: cannot be loaded: {self.said(error)}") from error
        return module


def _file_of(module: str) -> Path:
    """Return the file of a module in this folder or in Python's path."""
    _look_in(Path.cwd())
    try:
        found = importlib.util.find_spec(module)
    except Exception as error:  # what the packages around it raise
        said = " ".join(str(error).split()).rstrip(".")
        raise InputError(f"{module}: {type(error).__name__}: {said}; {OR_MODULE}") from error
    if found is None or found.origin is None or not Path(found.origin).is_file():
        raise InputError(f"there is no module {module}; {OR_MODULE}")
    return Path(found.origin)


def _look_in(folder: Path) -> None:
    """Have modules found in a folder too."""
    place = str(folder.resolve())
    if place not in sys.path:
        sys.path.append(place)  # at the end, where it hides nothing


def _is_of(thing: Any, module: ModuleType) -> bool:
    """Tell whether something is a function that a module has made itself."""
    return callable(thing) and getattr(thing, "__module__", "") == module.__name__


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
