"""How a scan lies in another: `register`."""

from surfsig.registration.registration import Registration
from surfsig.registration.search import register

__all__ = ["Registration", "register"]
