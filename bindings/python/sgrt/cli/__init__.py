"""The command line `sgrt` (docs/formats.md): one module a command."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Sequence

import click

from .. import __version__
from ..errors import Error
from . import (
    advise,
    calibrate,
    calibrate_laser,
    calibrate_room,
    calibrate_tof,
    check,
    curvature,
    evaluate,
    filter,
    fit,
    fuse,
    landmarks,
    laser,
    reference,
    register,
    stereo,
    tof,
    track,
)
from ._common import Failure, exit_code, one_line


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(__version__, prog_name="sgrt", message="%(prog)s %(version)s")
def group() -> None:
    """Surface-guided radiation therapy: camera images of a patient's skin to a six-degree couch shift.

    Lengths are mm; the room frame is IEC 61217 fixed. Not a medical device.

    Exit codes: 0 an answer; 1 the data have none; 2 the call or a file is wrong; 130 cancelled; 3 a defect of the
    program.
    """


calibrate.command.add_command(calibrate_room.command)
calibrate.command.add_command(calibrate_laser.command)
group.add_command(calibrate.command)
group.add_command(stereo.command)
group.add_command(laser.command)
calibrate.command.add_command(calibrate_tof.command)
group.add_command(calibrate.command)
group.add_command(stereo.command)
group.add_command(tof.command)
group.add_command(fuse.command)
group.add_command(filter.command)
group.add_command(fit.command)
group.add_command(evaluate.command)
group.add_command(curvature.command)
group.add_command(landmarks.command)
group.add_command(register.command)
group.add_command(advise.command)
group.add_command(check.command)
group.add_command(reference.group)
group.add_command(track.command)
if importlib.util.find_spec("sgrt.demo"):
    from . import demo

    group.add_command(demo.command)


# click 8.2 raises it where older ones show the help and end well.
NO_ARGUMENTS: tuple[type[click.UsageError], ...] = tuple(
    cls for name, cls in vars(click.exceptions).items() if name == "NoArgsIsHelpError"
)


def main(argv: Sequence[str] | None = None) -> int:
    """Runs a command; returns its exit code. An error is one line on standard error."""
    try:
        code = group.main(args=None if argv is None else list(argv), prog_name="sgrt", standalone_mode=False)
        return code if isinstance(code, int) else 0
    except NO_ARGUMENTS as error:
        click.echo(error.ctx.get_help() if error.ctx else "", err=True)
        return 2
    except click.ClickException as error:
        message, code = error.format_message(), 2
    except (KeyboardInterrupt, click.Abort):
        message, code = "cancelled", 130
    except (Failure, Error, OSError, MemoryError) as error:
        message, code = str(error), exit_code(error)
        if isinstance(error, OSError) and error.filename is not None:
            message = f"{error.filename}: {error.strerror}"
        elif isinstance(error, MemoryError) and not message:
            message = "out of memory"
    except Exception as error:
        message, code = f"a defect of sgrt, please report it: {type(error).__name__}: {error}", 3
    print(f"sgrt: {one_line(message)}", file=sys.stderr)
    return code
