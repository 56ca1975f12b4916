"""What the package offers: names that hide nothing, and every class that its functions take or give."""

import importlib
import inspect
import pkgutil
import subprocess
import sys
from collections.abc import Iterator
from types import ModuleType, SimpleNamespace
from typing import Any, get_args, get_type_hints

import pytest

import surfsig
import surfsig.files
import surfsig.plot
import surfsig.simulate

MADE_BY_A_FUNCTION = {"ScanSequence.__init__"}
"""Constructors that users do not call, because a function of the package does."""

IMPORTED_FOR_CHECKERS = {
    "pd": SimpleNamespace(DataFrame=object),
    "pa": SimpleNamespace(Table=object),
    "Axes": object,
    "Client": object,
    "ScalarMappable": object,
    "Extraction": surfsig.Extraction,
    "ShapeKind": str,
}
"""Names in type hints that modules import for type checkers only."""


def packages() -> Iterator[ModuleType]:
    """Give the package, and the packages in it."""
    yield surfsig
    for module in pkgutil.walk_packages(surfsig.__path__, "surfsig."):
        if module.ispkg:
            yield importlib.import_module(module.name)


def hinted(module: ModuleType) -> Iterator[tuple[str, Any]]:
    """Give a module's public functions and classes, and the methods and properties of these."""
    for name in getattr(module, "__all__", [name for name in vars(module) if name[0] != "_"]):
        thing = getattr(module, name)
        if not getattr(thing, "__module__", "").startswith("surfsig"):
            continue
        if inspect.isfunction(thing) or inspect.isclass(thing):
            yield name, thing
        for attribute, value in vars(thing).items() if inspect.isclass(thing) else ():
            function = value.fget if isinstance(value, property) else getattr(value, "__func__", value)
            if inspect.isfunction(function) and (attribute[0] != "_" or attribute == "__init__"):
                yield f"{name}.{attribute}", function


def classes_in(hint: Any) -> Iterator[type]:
    """Give the classes of surfsig that a type hint names."""
    if inspect.isclass(hint) and hint.__module__.partition(".")[0] == "surfsig":
        yield hint
    for part in hint if isinstance(hint, list) else get_args(hint):
        yield from classes_in(part)


@pytest.mark.parametrize("module", [surfsig, surfsig.files, surfsig.simulate, surfsig.plot])
def test_each_class_that_is_taken_or_given_is_exported(module: ModuleType) -> None:
    exported = {getattr(surfsig, name) for name in surfsig.__all__ if inspect.isclass(getattr(surfsig, name))}
    if module is not surfsig:
        exported |= {thing for name, thing in hinted(module) if inspect.isclass(thing)}
    missing = {
        f"{name} names {kind.__module__}.{kind.__qualname__}"
        for name, thing in hinted(module)
        if name not in MADE_BY_A_FUNCTION
        for hint in get_type_hints(thing, localns=IMPORTED_FOR_CHECKERS).values()
        for kind in classes_in(hint)
        if kind not in exported
    }
    assert not missing


def test_no_public_name_is_also_a_module() -> None:
    """A function with the name of its package's module would hide it from whoever imports the module."""
    modules = {module.name for module in pkgutil.walk_packages(surfsig.__path__, "surfsig.")}
    hidden = {
        f"{package.__name__}.{name}"
        for package in packages()
        for name in getattr(package, "__all__", ())
        if f"{package.__name__}.{name}" in modules
    }
    assert not hidden


@pytest.mark.parametrize("package", list(packages()), ids=lambda package: package.__name__)
def test_a_package_is_imported_as_a_module(package: ModuleType) -> None:
    parent, _, name = package.__name__.rpartition(".")
    assert inspect.ismodule(getattr(importlib.import_module(parent), name) if parent else package)
    assert all(hasattr(package, name) for name in getattr(package, "__all__", ()))


def test_scipy_is_loaded_where_it_is_used_only() -> None:
    """Its parts take longer to load than all of surfsig does, and most calls of the shell need none."""
    code = "import sys, surfsig; print({'scipy.spatial', 'scipy.stats'} & sys.modules.keys())"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "set()"
