"""The reference has words for every public name: what it takes, gives and refuses."""

import ast
import dataclasses
import inspect
import itertools
import textwrap
from collections.abc import Callable
from typing import Any

import pytest

import surfsig
import surfsig.files
import surfsig.plot
import surfsig.simulate

Function = Callable[..., Any]

CLASSES = [thing for name in surfsig.__all__ if inspect.isclass(thing := getattr(surfsig, name))]
MODULES = (surfsig, surfsig.files, surfsig.simulate, surfsig.plot)


def public_functions() -> list[Any]:
    """Give the functions of the public modules, and the methods of the package's own classes."""
    found: dict[str, Function] = {}
    for module in MODULES:
        names = getattr(module, "__all__", None) or [name for name in vars(module) if name[0] != "_"]
        for name in names:
            thing = getattr(module, name)
            if inspect.isfunction(thing) and thing.__module__.startswith("surfsig"):
                found[f"{module.__name__}.{name}"] = thing
    for kind in CLASSES:
        for name in vars(kind):
            if name[0] != "_" and inspect.isroutine(method := getattr(kind, name)):
                found[f"{kind.__name__}.{name}"] = method
    return [pytest.param(function, id=name) for name, function in found.items()]


def sections(function: Function) -> dict[str, list[str]]:
    """Give the numpydoc sections of a docstring, each with its lines."""
    found: dict[str, list[str]] = {"": []}
    lines = (inspect.getdoc(function) or "").splitlines()
    title = ""
    for line, below in zip(lines, [*lines[1:], ""], strict=True):
        if below and set(below) == {"-"}:
            title = line
            found[title] = []
        elif not (line and set(line) == {"-"}):
            found[title].append(line)
    return found


def documented(lines: list[str]) -> set[str]:
    """Give the names that a section of parameters or attributes explains."""
    heads = [line.partition(" : ")[0] for line in lines if line and not line[0].isspace()]
    return {name.strip(" *") for head in heads for name in head.split(",")}


def raises(function: Function) -> bool:
    """Tell whether a function's own code raises something; what is compiled is not looked into."""
    if not inspect.isfunction(function):
        return False
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    return any(isinstance(node, ast.Raise) and node.exc is not None for node in ast.walk(tree))


@pytest.mark.parametrize("function", public_functions())
def test_a_function_says_what_it_takes_gives_and_refuses(function: Function) -> None:
    found = sections(function)
    signature = inspect.signature(function)
    assert found[""]
    assert documented(found.get("Parameters", [])) == set(signature.parameters) - {"self", "cls"}
    if signature.return_annotation not in (None, "None"):
        assert "Returns" in found or "Yields" in found
    if raises(function):
        assert "Raises" in found


@pytest.mark.parametrize("kind", CLASSES)
def test_a_class_says_what_each_of_its_values_is(kind: type) -> None:
    found = sections(kind)
    told = documented(found.get("Attributes", []) + found.get("Parameters", []))
    for base in kind.__mro__:
        # Those that are inherited are told where they are declared.
        if dataclasses.is_dataclass(base):
            told |= words_below(base)
    assert found[""]
    for name in [*getattr(kind, "__dataclass_fields__", {}), *vars(kind)]:
        if name[0] != "_" and name not in told:
            assert inspect.getdoc(inspect.getattr_static(kind, name)), name


def words_below(kind: type) -> set[str]:
    """Give the values of a class that have a string below them."""
    body = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0].body  # type: ignore[attr-defined]
    return {
        value.target.id
        for value, below in itertools.pairwise(body)
        if isinstance(value, ast.AnnAssign)
        and isinstance(value.target, ast.Name)
        and isinstance(below, ast.Expr)
        and isinstance(below.value, ast.Constant)
    }


def test_the_package_says_what_each_of_its_names_is() -> None:
    for name in surfsig.__all__:
        if isinstance(getattr(surfsig, name), str):
            assert f"`{name}`" in (surfsig.__doc__ or "")
        else:
            assert inspect.getdoc(getattr(surfsig, name))
