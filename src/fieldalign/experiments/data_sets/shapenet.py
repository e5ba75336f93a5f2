"""ShapeNetCore v2 (Chang et al., arXiv 1512.03012): SYNSET/HASH/models/model_normalized.obj.

The paper takes 12 of its 55 categories, and does not say which; nor does PointNetLK-Revisited's program, whose test.py
takes a list of categories for "shapenet2" that is not among its files. Taken here are the last 12 in the order of their
ids, as the unseen half of ModelNet40 is the last in the order of the names; the list that PointNetLK's program brings
(experiments/sampledata/shapenet2_20.txt) holds the first 20, so none of them. To test on others, name them.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from ...odometry.sequences.folders import natural_order
from .files import PathLike, as_folder, first_of, inside, nothing_of
from .modelnet import chosen
from .shapes import Shape, mesh_in

CATEGORIES = {
    "02691156": "airplane", "02747177": "trash bin", "02773838": "bag", "02801938": "basket", "02808440": "bathtub",
    "02818832": "bed", "02828884": "bench", "02843684": "birdhouse", "02871439": "bookshelf", "02876657": "bottle",
    "02880940": "bowl", "02924116": "bus", "02933112": "cabinet", "02942699": "camera", "02946921": "can",
    "02954340": "cap", "02958343": "car", "02992529": "cellphone", "03001627": "chair", "03046257": "clock",
    "03085013": "keyboard", "03207941": "dishwasher", "03211117": "display", "03261776": "earphone",
    "03325088": "faucet", "03337140": "file cabinet", "03467517": "guitar", "03513137": "helmet", "03593526": "jar",
    "03624134": "knife", "03636649": "lamp", "03642806": "laptop", "03691459": "loudspeaker", "03710193": "mailbox",
    "03759954": "microphone", "03761084": "microwaves", "03790512": "motorbike", "03797390": "mug",
    "03928116": "piano", "03938244": "pillow", "03948459": "pistol", "03991062": "flowerpot", "04004475": "printer",
    "04074963": "remote", "04090263": "rifle", "04099429": "rocket", "04225987": "skateboard", "04256520": "sofa",
    "04330267": "stove", "04379243": "table", "04401088": "telephone", "04460130": "tower", "04468005": "train",
    "04530566": "watercraft", "04554684": "washer",
}
"""ShapeNetCore v2's synsets of WordNet 3.0 and their names."""

UNSEEN = tuple(list(CATEGORIES.values())[-12:])
"""A choice of this project: see above."""

LAYOUTS = (
    "ShapeNetCore.v2 (SYNSET/HASH/models/model_normalized.obj)",
    "meshes/*.obj, which stand in for it as the category 'procedural'",
)


def shapes(folder: PathLike, categories: Sequence[str] | None = None) -> list[Shape]:
    """The shapes of ShapeNetCore v2 in a folder, by the ids of their categories, then by hash.

    folder: ShapeNetCore.v2, one that holds it, or one that holds `meshes` as a stand-in. categories: names or ids;
    None: UNSEEN, or all that there are where the folder has none of these.

    A shape's name is SYNSET/HASH, since a hash may stand in several categories. Raises DataSetError where there is
    nothing of it.
    """
    place = as_folder(folder)
    found = first_of(_in_core, inside(place, "ShapeNetCore.v2")) or first_of(_in_meshes, inside(place, "meshes"))
    if not found:
        raise nothing_of("ShapeNetCore v2", place, LAYOUTS)
    wanted = None if categories is None else [CATEGORIES.get(name, name) for name in categories]
    return chosen(found, wanted, UNSEEN, place)


def _in_core(place: Path) -> list[Shape]:
    files = sorted(file for synset in CATEGORIES for file in place.glob(f"{synset}/*/models/model_normalized.obj"))
    return [Shape(CATEGORIES[file.parts[-4]], "/".join(file.parts[-4:-2]), partial(mesh_in, file)) for file in files]


def _in_meshes(place: Path) -> list[Shape]:
    files = sorted(place.glob("*.obj"), key=natural_order)
    return [Shape("procedural", file.stem, partial(mesh_in, file)) for file in files]
