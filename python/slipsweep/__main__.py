"""`python -m slipsweep` is the command `slipsweep`."""

from ._command import main

main()
