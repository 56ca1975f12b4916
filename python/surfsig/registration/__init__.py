"""How a scan lies in another: `register`; and many in one: `register_scans`."""

from surfsig.registration.registration import Alternative, Registration
from surfsig.registration.search import register
from surfsig.registration.several import RegisteredPair, RegisteredScans, register_scans

__all__ = [
    "Alternative",
    "RegisteredPair",
    "RegisteredScans",
    "Registration",
    "register",
    "register_scans",
]
