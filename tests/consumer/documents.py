"""Runs what the book shows: the commands, specs and Python of every page, the examples, and the notebook as a fresh clone opens it.

Usage: documents.py [--write] FOLDER [PAGE ...]

FOLDER holds the program `slipsweep`; the Python package is installed. Without pages, all of them run, then the examples and the notebook. The blocks of a page run in
order, in an empty folder of the page's own:

- `toml` that begins with `name = "NAME"` is saved as NAME.toml before the first command;
- `sh` and `python` run;
- `text` must occur in their standard output, and `output` with other numbers: those of times, sizes and differences;
- a picture `pictures/NAME.svg` must be a file that they wrote, byte for byte.

The sweeps of the README run first, and print its numbers.

A page without commands shows measurements, which `benches/document` writes with their pictures.

`--write` copies the pictures to docs/pictures instead, and replaces a `text` block that is not printed by the whole output of the block before it.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient

REPOSITORY = Path(os.environ.get("REPOSITORY", Path(__file__).resolve().parents[2]))
EXAMPLES = REPOSITORY / "examples/python"
PICTURES = REPOSITORY / "docs/pictures"


def environment(folder):
    """The environment of a command: the program on the path, and the folder of this clone."""
    return os.environ | {"REPOSITORY": str(REPOSITORY), "PATH": os.pathsep.join([str(folder), os.environ["PATH"]]), "MPLBACKEND": "Agg"}


def run(command, folder, variables):
    """The standard output of a command; ends the program if it fails."""
    done = subprocess.run(command, cwd=folder, env=variables, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)[:300]}\n{done.stdout}{done.stderr}")
    return done.stdout


def blocks_of(text):
    """The language and code of every block, in order."""
    return re.findall(r"^```(\w+)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def masked(text):
    """A text without its numbers, bounds, units of time and size, and spacing."""
    text = text.replace("less than", "about")
    return re.sub(r"\s+", " ", re.sub(r"[\d.,]*\d(e-?\d+)?( ?(ns|µs|ms|s|min|h|d|kB|MB|GB|TB)\b)?", "#", text)).strip()


def run_bullets(text, folder, variables):
    """Runs the sweep of every bullet of the README, which prints the numbers of the bullet, except times."""
    for bullet in re.findall(r"^- .*(?:\n  .*)*", text, re.MULTILINE):
        sweep = re.search(r"`slipsweep run (sweeps/\w+\.toml)`", bullet)[1]
        printed = run(["slipsweep", "run", str(REPOSITORY / sweep)], folder, variables)
        for number in re.findall(r"\d[\d,.]*\d(?:e-?\d+)?", re.sub(r"`[^`]*`| in [\d.]+ s\b", "", bullet)):
            # A number with an exponent is rounded.
            def states(other):
                if "e" not in number:
                    return other == number
                decimals = len(number.split("e")[0].partition(".")[2])
                return "e" in other and f"{float(other):.{decimals}e}" == f"{float(number):.{decimals}e}"

            if not any(map(states, re.findall(r"\d[\d,.]*\d(?:e-?\d+)?", printed))):
                sys.exit(f"README.md: {sweep} does not print {number}:\n{printed}")


def run_page(page, variables, write):
    """Runs the blocks of a page and checks its output and pictures; returns how many blocks ran."""
    text = page.read_text()
    name = page.relative_to(REPOSITORY)
    count = 0
    with tempfile.TemporaryDirectory() as folder:
        for language, code in blocks_of(text):
            if language == "toml" and (named := re.match(r'name = "([\w-]+)"', code)):
                (Path(folder) / f"{named[1]}.toml").write_text(code)
        if page.name == "README.md" and page.parent == REPOSITORY:
            run_bullets(text, folder, variables)
        printed, output = "", ""
        stale = []
        for language, code in blocks_of(text):
            if language in ("sh", "python"):
                command = ["bash", "-euo", "pipefail", "-c"] if language == "sh" else [sys.executable, "-c"]
                output = run([*command, code], folder, variables)
                printed += output
                count += 1
            elif language == "text":
                stale.append((code, output))
            elif language == "output":
                for line in code.splitlines():
                    if line != "[...]" and masked(line) not in {masked(other) for other in printed.splitlines()}:
                        sys.exit(f"{name}: no line like this is printed:\n{line}\nprinted:\n{printed}")
        if not count:
            return 0
        for code, output in stale:
            if code not in printed:
                if not write:
                    sys.exit(f"{name}: this output is not printed:\n{code}\nprinted:\n{printed}")
                text = text.replace(f"```text\n{code}```", f"```text\n{output}```", 1)
                page.write_text(text)
                print(f"{name}: output replaced")
        for picture in re.findall(r"\]\((?:\.\./)*(?:docs/)?pictures/([\w.-]+)\)", text):
            made = Path(folder) / picture
            if not made.is_file():
                sys.exit(f"{name}: no command of the page writes the picture {picture}")
            if write:
                PICTURES.mkdir(exist_ok=True)
                shutil.copy(made, PICTURES / picture)
            elif made.read_bytes() != (PICTURES / picture).read_bytes():
                sys.exit(f"{name}: the picture {picture} is not the committed one; write it with --write and look at it")
    return count


def run_notebook(clone):
    """Executes the notebook in the files of a clone, without the program on the path; returns its number of cells."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "examples"],
        cwd=REPOSITORY, capture_output=True, text=True, check=True,
    )
    for name in listed.stdout.split("\0")[:-1]:
        (clone / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(REPOSITORY / name, clone / name)
    path = clone / EXAMPLES.relative_to(REPOSITORY) / "first_look.ipynb"
    cells = nbformat.read(path, as_version=4)
    folders = [folder for folder in os.environ["PATH"].split(os.pathsep) if not (Path(folder) / "slipsweep").exists()]
    client = NotebookClient(cells, timeout=600, resources={"metadata": {"path": str(path.parent)}})
    client.execute(env=os.environ | {"PATH": os.pathsep.join(folders), "PYTHONWARNINGS": "error::DeprecationWarning:__main__"})
    code = [cell for cell in cells.cells if cell.cell_type == "code"]
    shown = [(kind, str(data)) for cell in code for output in cell.outputs for kind, data in output.get("data", {}).items()]
    pages = [data for kind, data in shown if kind == "text/html"]
    assert sum(kind == "image/png" for kind, _ in shown) == 3, shown
    # Three runs with a bar, a table with its units, a trace with its picture.
    assert sum("<progress " in page and "100% of" in page for page in pages) == 3, pages
    assert sum("<table>" in page and "<i>mu_0 sigma l</i>" in page for page in pages) == 1, pages
    assert sum(page.startswith("<svg") for page in pages) == 1, pages
    return len(code)


def main():
    parser = argparse.ArgumentParser(description="Run what the book shows.")
    parser.add_argument("program", type=lambda text: Path(text).resolve(), metavar="FOLDER")
    parser.add_argument("--write", action="store_true", help="copy the pictures to docs/pictures instead of comparing them")
    parser.add_argument("pages", nargs="*", metavar="PAGE", type=lambda text: Path(text).resolve())
    arguments = parser.parse_intermixed_args()
    variables = environment(arguments.program)

    pages = arguments.pages or [REPOSITORY / "README.md", *sorted((REPOSITORY / "docs").rglob("*.md"))]
    count = sum(run_page(page, variables, arguments.write) for page in pages)
    print(f"{len(pages)} pages: {count} blocks")
    if arguments.pages:
        return
    assert count >= 10, count
    with tempfile.TemporaryDirectory() as folder:
        for language, code in blocks_of((REPOSITORY / "docs/examples.md").read_text()):
            if language == "sh":
                run(["bash", "-euo", "pipefail", "-c", code], folder, variables)
        scripts = sorted(EXAMPLES.glob("with_*.py"))
        answers = {script.stem: run([sys.executable, str(script), "answers"], folder, variables) for script in scripts}
        assert len(answers) == 4 and len(set(answers.values())) == 1, answers
        answer = next(iter(answers.values()))
        for question in ["landscape", "crossover", "stick-slip"]:
            assert f"{question}: " in answer, answer
    with tempfile.TemporaryDirectory() as folder:
        cells = run_notebook(Path(folder))
    print(f"{len(answers)} examples that agree, a notebook of {cells} cells")


main()
