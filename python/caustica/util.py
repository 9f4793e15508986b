"""Files of pictures, as Mitsuba has them."""
from caustica._image import write_bitmap

__all__ = ["write_bitmap"]
