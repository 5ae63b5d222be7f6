"""Progress of a run: a line in a terminal, a bar in a notebook."""

import sys
import time
from collections.abc import Callable
from typing import Any

# Seconds before progress is shown. Chosen: shorter runs show nothing.
SILENCE = 0.5


def display(name: str, progress: bool | Callable[[str, int, int], object] | None) -> Any:
    """What is called with the phase, the rows done and all rows; `None` if nothing is."""
    if callable(progress):
        return progress
    if progress is False:
        return None
    if _in_notebook():
        return NotebookBar(name)
    return TerminalLine(name) if progress or sys.stderr.isatty() else None


def _in_notebook() -> bool:
    if "IPython" not in sys.modules:
        return False
    from IPython import get_ipython

    return type(get_ipython()).__name__ == "ZMQInteractiveShell"


class Progress:
    """How far a run is."""

    def __init__(self, name: str) -> None:
        self.name, self.start, self.is_shown = name, time.monotonic(), False

    def __call__(self, phase: str, done: int, rows: int) -> None:
        """Shows the state of the run."""
        if self.is_shown or time.monotonic() - self.start > SILENCE:
            self.is_shown = True
            self.show(phase, done, rows)

    def words(self, phase: str, done: int, rows: int) -> str:
        """The state in words."""
        if phase != "computing":
            return f"{self.name}: {phase}"
        return f"{self.name}: {done / max(rows, 1):.0%} of {rows:,} rows"

    def show(self, phase: str, done: int, rows: int) -> None:
        """Shows the state."""
        raise NotImplementedError

    def close(self) -> None:
        """Ends the display."""


class TerminalLine(Progress):
    """A line that is written over."""

    def show(self, phase: str, done: int, rows: int) -> None:
        print(f"\r\x1b[K{self.words(phase, done, rows)}", end="", file=sys.stderr, flush=True)

    def close(self) -> None:
        if self.is_shown:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)


class NotebookBar(Progress):
    """A bar below a cell."""

    handle: Any = None

    def show(self, phase: str, done: int, rows: int) -> None:
        from IPython.display import HTML, display

        bar = HTML(f"<progress value='{done}' max='{max(rows, 1)}'></progress> {self.words(phase, done, rows)}")
        if self.handle is None:
            self.handle = display(bar, display_id=True)
        else:
            self.handle.update(bar)

    def close(self) -> None:
        if self.handle is not None:
            from IPython.display import HTML

            self.handle.update(HTML(""))
