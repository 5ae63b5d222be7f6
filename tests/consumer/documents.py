"""Runs what README, docs and examples show: their commands and Python, in order, each document in a folder of its own; the notebook as a
fresh clone opens it.

Usage: documents.py FOLDER, in which the program `slipsweep` is.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient

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


def notebook(clone):
    """Executes the notebook in the files of a clone, with the program in target/release and not on the path; returns how many cells it has."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "examples"],
        cwd=REPOSITORY, capture_output=True, text=True, check=True,
    )
    for name in listed.stdout.split("\0")[:-1]:
        (clone / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(REPOSITORY / name, clone / name)
    (clone / "target/release").mkdir(parents=True)
    shutil.copy(Path(sys.argv[1]) / "slipsweep", clone / "target/release")
    place = clone / PYTHON.relative_to(REPOSITORY) / "first_look.ipynb"
    cells = nbformat.read(place, as_version=4)
    folders = [folder for folder in os.environ["PATH"].split(os.pathsep) if not (Path(folder) / "slipsweep").exists()]
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    client = NotebookClient(cells, timeout=600, resources={"metadata": {"path": str(place.parent)}})
    client.execute(env=environment | {"PATH": os.pathsep.join(folders), "PYTHONWARNINGS": "error::DeprecationWarning:__main__"})
    code = [cell for cell in cells.cells if cell.cell_type == "code"]
    pictures = [output for cell in code for output in cell.outputs if "image/png" in output.get("data", {})]
    assert len(pictures) == 3, len(pictures)
    return len(code)


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
        answers = {script.stem: run([sys.executable, str(script), "answers"], folder) for script in scripts}
        assert len(answers) == 4 and len(set(answers.values())) == 1, answers
        answer = next(iter(answers.values()))
        for question in ["landscape", "crossover", "stick-slip"]:
            assert f"{question}: " in answer, answer
    with tempfile.TemporaryDirectory() as folder:
        cells = notebook(Path(folder))
    print(f"documents: {blocks} blocks, {len(answers)} examples that agree, a notebook of {cells} cells")


main()
