import os

import numpy.typing as npt

from caustica import Image

__all__ = ["write_bitmap"]

def write_bitmap(path: str | os.PathLike[str], image: Image | npt.ArrayLike) -> None: ...
