"""Runs what README, docs and examples show: their commands and Python, in order, each document in a folder of its own.

Usage: documents.py FOLDER, in which the program `slipsweep` is.
"""

import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
PYTHON = REPOSITORY / "examples/python"
ENVIRONMENT = os.environ | {
    "PATH": os.pathsep.join([str(Path(sys.argv[1]).resolve()), os.environ["PATH"]]),
    "PYTHONPATH": str(PYTHON),
    "MPLBACKEND": "Agg",
}


def run(command, folder):
    done = subprocess.run(command, cwd=folder, env=ENVIRONMENT, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)[:300]}\n{done.stdout}{done.stderr}")
    return done.stdout


def document(path, folder):
    """Runs the blocks of a document; returns how many it has."""
    blocks = re.findall(r"^```(sh|python)\n(.*?)^```$", path.read_text(), re.MULTILINE | re.DOTALL)
    for language, code in blocks:
        command = ["bash", "-euo", "pipefail", "-c"] if language == "sh" else [sys.executable, "-c"]
        run([*command, code], folder)
    return len(blocks)


def main():
    blocks = 0
    for path in [REPOSITORY / "README.md", *sorted((REPOSITORY / "docs").glob("*.md"))]:
        with tempfile.TemporaryDirectory() as folder:
            if path.name == "README.md":
                # The first of its two commands, which builds the program besides.
                run(["slipsweep", "run", str(REPOSITORY / "sweeps/landscape.toml")], folder)
            blocks += document(path, folder)
    assert blocks >= 10, blocks

    with tempfile.TemporaryDirectory() as folder:
        document(REPOSITORY / "examples/README.md", folder)
        scripts = sorted(PYTHON.glob("with_*.py"))
        answers = {script.stem: run([sys.executable, str(script), "results"], folder) for script in scripts}
        assert len(answers) == 4 and len(set(answers.values())) == 1, answers
        answer = next(iter(answers.values()))
        for question in ["landscape", "crossover", "stick-slip"]:
            assert f"{question}: " in answer, answer
        notebook = json.loads((PYTHON / "first_look.ipynb").read_text())
        cells = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
        run([sys.executable, "-W", "error::DeprecationWarning:__main__", "-c", "\n".join(cells)], folder)
    print(f"documents: {blocks} blocks, {len(answers)} examples that agree, a notebook of {len(cells)} cells")


main()
