"""The `dgd` command."""

from __future__ import annotations

import signal
import sys

from ._dgd import command


def main() -> int:
    """Runs the command line of this process; the exit code."""
    # The command minds Ctrl-C by itself, where it does not, Ctrl-C ends the process.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return command(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
