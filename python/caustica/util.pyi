import os

import numpy.typing as npt

from caustica import Image

__all__ = ["write_bitmap"]

def write_bitmap(filename: str | os.PathLike[str], data: Image | npt.ArrayLike, write_async: bool = ...,
                 quality: int = ...) -> None: ...
