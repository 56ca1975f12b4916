"""What goes wrong by the caller's doing, as exceptions with a one-line message."""


class SurfsigError(ValueError):
    """Any mistake that the caller can mend; its text is one line and says what to do."""

    def __init__(self, message: str) -> None:
        # Messages quote files and names, in which any character may stand: line feeds, codes for a terminal.
        super().__init__("".join(" " if c.isspace() else c if c.isprintable() else "?" for c in str(message)))


class InvalidInputError(SurfsigError):
    """An argument, array or option that has no meaning here (a radius of 0, an array of the wrong shape)."""


class FileFormatError(SurfsigError):
    """A file that cannot be read as what it says it is: wrong format, cut off, broken."""
