import os

import numpy.typing as npt

from caustica import Image

def write_bitmap(path: str | os.PathLike[str], image: Image | npt.ArrayLike) -> None: ...
