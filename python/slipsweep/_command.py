"""The command `slipsweep`."""

import signal
import sys

from . import _core


def main() -> None:
    """Runs the command line and exits with its code."""
    # Ctrl-C is answered by the program, not by Python.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(_core.main(["slipsweep", *sys.argv[1:]], sys.stdout is None))
