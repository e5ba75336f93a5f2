"""Makes the notebooks of the programs beside this file, and runs them, so that their pictures are in them.

    python examples/notebooks/make.py [first_pair ...]

A program is cut at its lines "# %%" (code) and "# %% [markdown]" (text, each line after "# "). The tests hold that each
notebook has the cells of its program, and that they run. Needs nbformat, nbclient, ipykernel and matplotlib.
"""

import base64
import io
import re
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import nbformat
from nbclient import NotebookClient
from nbformat import v4
from PIL import Image

HERE = Path(__file__).parent
WIDTH = 900  # pixels of a picture, at most: the notebooks lie in the repository
CUT = re.compile(r"^# %%(.*)\n", re.MULTILINE)


def notebook_of(program):
    """The notebook of a program, not yet run."""
    _, *pieces = CUT.split(program.read_text(encoding="utf-8"))
    cells = []
    for number, (kind, text) in enumerate(zip(pieces[::2], pieces[1::2], strict=True)):
        if "[markdown]" in kind:
            cell = v4.new_markdown_cell(re.sub(r"^# ?", "", text.strip(), flags=re.MULTILINE))
        else:
            cell = v4.new_code_cell(text.strip())
        cell.id = f"cell-{number}"
        cells.append(cell)
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    return v4.new_notebook(cells=cells, metadata=kernel)


def run(notebook, folder):
    """Runs all cells, in a folder; what they show is then in the notebook. Raises CellExecutionError."""
    return NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(folder)}}).execute()


def light(picture):
    """A PNG in base64, no wider than WIDTH and of 128 colours."""
    image = Image.open(io.BytesIO(base64.b64decode(picture))).convert("RGB")
    image.thumbnail((WIDTH, 10 * WIDTH))
    written = io.BytesIO()
    image.quantize(128, dither=Image.Dither.NONE).save(written, "png", optimize=True)
    return base64.b64encode(written.getvalue()).decode()


def programs():
    """All of them."""
    return sorted(path for path in HERE.glob("*.py") if path.name != "make.py")


def main():
    """Writes them."""
    for program in programs():
        if sys.argv[1:] and program.stem not in sys.argv[1:]:
            continue
        with TemporaryDirectory() as folder:
            notebook = run(notebook_of(program), folder)
        for cell in notebook.cells:
            cell.metadata.clear()  # when it ran
            for output in cell.get("outputs", ()):
                if "image/png" in output.get("data", ()):
                    output.data["image/png"] = light(output.data["image/png"])
        nbformat.write(notebook, program.with_suffix(".ipynb"))


if __name__ == "__main__":
    main()
