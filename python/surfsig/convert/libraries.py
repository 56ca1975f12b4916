"""Libraries that are there only where the user has them."""

from __future__ import annotations

import importlib
from typing import Any

from surfsig.errors import InvalidInputError


def library(module: str, name: str, package: str) -> Any:
    """Import a library.

    Parameters
    ----------
    module
        What is imported.
    name
        What people call it.
    package
        What pip installs.

    Raises
    ------
    InvalidInputError
        If it is missing, with the command that installs it, or cannot be loaded.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError:
        raise InvalidInputError(f"{name} is not installed: pip install {package}") from None
    except ImportError as error:
        raise InvalidInputError(f"{name} cannot be loaded: {' '.join(str(error).split())}") from None
