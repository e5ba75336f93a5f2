"""Small data sets in their published layouts, written for the tests."""

import numpy as np
import pytest

CORNERS = np.array([[0, 0, 0], [4, 0, 0], [0, 2, 0], [0, 0, 1.0]])
FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]


@pytest.fixture(scope="session")
def tetrahedron():
    return CORNERS, np.array(FACES)


@pytest.fixture(scope="session")
def write_off():
    """Writes the tetrahedron, longer by a factor, as ModelNet40 does; `head` may lack its line end."""

    def write(path, factor=1.0, head="OFF\n"):
        path.parent.mkdir(parents=True, exist_ok=True)
        rows = ["{:g} {:g} {:g}".format(*row) for row in CORNERS * factor] + ["3 {} {} {}".format(*f) for f in FACES]
        path.write_text(head + "4 4 0\n" + "\n".join(rows) + "\n")

    return write


@pytest.fixture(scope="session")
def write_obj():
    def write(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        rows = ["v {:g} {:g} {:g}".format(*row) for row in CORNERS]
        rows += ["f {} {} {}".format(*(np.array(f) + 1)) for f in FACES]
        path.write_text("\n".join(rows) + "\n")

    return write
