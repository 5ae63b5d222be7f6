"""Progress of a run: a line in a terminal, a bar in a notebook."""

import html
import sys
import time
from typing import Any

# Seconds before progress is shown. Chosen: shorter runs show nothing.
SILENCE = 0.5


def display(name: str, rows: int, progress: bool | None) -> "Progress | None":
    """The display of a run: at once for True, after a while for None, never for False."""
    if progress is False:
        return None
    silence = 0.0 if progress else SILENCE
    if _in_notebook():
        return NotebookBar(name, rows, silence)
    return TerminalLine(name, rows, silence) if progress or sys.stderr.isatty() else None


def _in_notebook() -> bool:
    if "IPython" not in sys.modules:
        return False
    from IPython import get_ipython

    return any(kind.__name__ == "ZMQInteractiveShell" for kind in type(get_ipython()).__mro__)


class Progress:
    """How far a run is."""

    def __init__(self, name: str, rows: int, silence: float) -> None:
        self.name, self.rows, self.since, self.is_shown = name, rows, time.monotonic() + silence, False

    def __call__(self, phase: str, done: int, rows: int) -> None:
        """Shows the state of the run."""
        if self.is_shown or time.monotonic() >= self.since:
            self.is_shown = True
            self.show(phase, done)

    def words(self, phase: str, done: int) -> str:
        """The state in words."""
        if phase != "computing":
            return f"{self.name}: {phase}"
        return f"{self.name}: {done / max(self.rows, 1):.0%} of {self.rows:,} rows"

    def show(self, phase: str, done: int) -> None:
        """Shows the state."""
        raise NotImplementedError

    def close(self, is_done: bool) -> None:
        """Ends the display."""


class TerminalLine(Progress):
    """A line that is written over, and removed at the end."""

    def show(self, phase: str, done: int) -> None:
        print(f"\r\x1b[K{self.words(phase, done)}", end="", file=sys.stderr, flush=True)

    def close(self, is_done: bool) -> None:
        if self.is_shown:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)


class NotebookBar(Progress):
    """A bar below a cell, which stays."""

    handle: Any = None

    def show(self, phase: str, done: int) -> None:
        from IPython.display import HTML, display

        text = html.escape(self.words(phase, done))
        bar = HTML(f"<progress value='{done}' max='{max(self.rows, 1)}'></progress> {text}")
        if self.handle is None:
            self.handle = display(bar, display_id=True)
        else:
            self.handle.update(bar)

    def close(self, is_done: bool) -> None:
        if is_done:
            self("computing", self.rows, self.rows)
