"""Each notebook has the cells of its program, and runs from top to bottom."""

import importlib.util
from pathlib import Path

import pytest

pytest.importorskip("nbclient")
import nbformat

FOLDER = Path(__file__).parents[2] / "examples/notebooks"


def the_maker():
    spec = importlib.util.spec_from_file_location("notebook_maker", FOLDER / "make.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


MAKER = the_maker()


@pytest.mark.parametrize("program", MAKER.programs(), ids=lambda path: path.stem)
def test_notebook_is_its_program(program):
    kept = nbformat.read(program.with_suffix(".ipynb"), as_version=4)
    made = MAKER.notebook_of(program)
    assert [(cell.cell_type, cell.source) for cell in kept.cells] == [(c.cell_type, c.source) for c in made.cells], (
        f"{program.stem}: run python examples/notebooks/make.py {program.stem}"
    )
    assert any("image/png" in output.get("data", ()) for cell in kept.cells for output in cell.get("outputs", ()))


@pytest.mark.filterwarnings("default::DeprecationWarning", "default::RuntimeWarning", "default::ResourceWarning")
@pytest.mark.parametrize("program", MAKER.programs(), ids=lambda path: path.stem)
def test_notebook_runs(program, tmp_path):
    notebook = MAKER.run(MAKER.notebook_of(program), tmp_path)
    assert all(cell.get("execution_count") for cell in notebook.cells if cell.cell_type == "code")
