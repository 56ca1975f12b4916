"""The command line, `surfsig`: its commands are those that are imported here.

Each command is a file here that calls the library's public functions and prints; `run` turns everything that
can go wrong into one line and an exit code.
"""

from __future__ import annotations

import contextlib
import logging
import sys
import warnings
from collections.abc import Iterator, Sequence

import click

from surfsig.cli.clean import clean_command
from surfsig.cli.compare import compare_command
from surfsig.cli.completion import completion_command
from surfsig.cli.convert import convert_command
from surfsig.cli.extract import extract_command
from surfsig.cli.find import find_command
from surfsig.cli.fit import fit_command
from surfsig.cli.info import info_command
from surfsig.cli.library import library_command
from surfsig.cli.odometry import odometry_command
from surfsig.cli.paper import paper_command
from surfsig.cli.register import register_command
from surfsig.cli.surfaces import surfaces_command
from surfsig.cli.view import view_command
from surfsig.errors import SurfsigError

__all__ = ["command_line", "main", "run"]

# What a shell reports for a program that Ctrl-C ended (128 + SIGINT).
INTERRUPTED = 130
FAILED = 2


@click.group(
    name="surfsig",
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Errors are one line on stderr, with the exit code 2.",
)
@click.version_option(package_name="surfsig", prog_name="surfsig", message="%(prog)s %(version)s")
def command_line() -> None:
    """Tell what a scanned surface is: curvature and surface signatures of point clouds.

    \b
    Begin with:
      surfsig info scan.ply                              what is in it, and how dense it is
      surfsig surfaces scan.ply                          its planes, cylinders, spheres, and their sizes
      surfsig extract scan.ply --radius 0.02 -o out.ply  curvature of every point, for CloudCompare
    """  # noqa: D301 - \b is click's mark for lines to be kept as they are


for command in (
    info_command,
    clean_command,
    extract_command,
    fit_command,
    surfaces_command,
    register_command,
    odometry_command,
    find_command,
    library_command,
    compare_command,
    convert_command,
    paper_command,
    view_command,
    completion_command,
):
    command_line.add_command(command)


def run(arguments: Sequence[str] | None = None) -> int:
    """Run one command and give its exit code: 0, 2 after an error, 130 after Ctrl-C.

    Parameters
    ----------
    arguments
        What follows the program's name; by default the process's own.
    """
    with _quiet_libraries(), warnings.catch_warnings():
        # Warnings are for users; those of other categories (NumPy's, deprecations) are for developers.
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", UserWarning)
        warnings.showwarning = lambda message, *_: _say("warning", message)
        try:
            command_line.main(
                args=None if arguments is None else list(arguments),
                prog_name="surfsig",
                standalone_mode=False,
            )
        except click.exceptions.NoArgsIsHelpError as error:
            click.echo(error.format_message(), err=True)
            return FAILED
        except click.ClickException as error:
            _say("error", error.format_message())
            return FAILED
        except click.exceptions.Exit as stop:
            return stop.exit_code
        except (click.Abort, KeyboardInterrupt):
            return INTERRUPTED
        except SurfsigError as error:
            _say("error", error)
            return FAILED
        except OSError as error:
            named = f"{error.filename}: {error.strerror}" if error.filename and error.strerror else error
            _say("error", named)
            return FAILED
    return 0


def main() -> None:
    """Run as a program."""
    sys.exit(run())


@contextlib.contextmanager
def _quiet_libraries() -> Iterator[None]:
    """Keep what libraries log (laspy does) off stderr, where lines are this program's."""
    handler, logging.lastResort = logging.lastResort, None
    raising, logging.raiseExceptions = logging.raiseExceptions, False
    try:
        yield
    finally:
        logging.lastResort, logging.raiseExceptions = handler, raising


def _say(kind: str, text: object) -> None:
    click.echo(f"surfsig: {kind}: {' '.join(str(text).split())}", err=True)
