"""How a scan lies in another: `register`; and many in one: `register_multiway`."""

from surfsig.alignment.alternative import Alternative
from surfsig.registration.multiway import MultiwayRegistration, RegisteredPair, register_multiway
from surfsig.registration.registration import Registration
from surfsig.registration.search import register

__all__ = [
    "Alternative",
    "MultiwayRegistration",
    "RegisteredPair",
    "Registration",
    "register",
    "register_multiway",
]
