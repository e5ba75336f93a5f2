"""Every example runs from top to bottom."""

import runpy
from pathlib import Path

import pytest

NEEDED = {"neural_field": "torch", "ros2_node": "rclpy"}  # packages beyond those of the tests
EXAMPLES = sorted((Path(__file__).parents[1] / "examples").glob("*.py"))


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example(example, capsys):
    pytest.importorskip(NEEDED.get(example.stem, "fieldalign"))
    runpy.run_path(str(example), run_name="__main__")
    said = capsys.readouterr().out
    assert "accepted" in said.lower()
    assert "not accepted" not in said.lower()
