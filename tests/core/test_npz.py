"""Arrays of a file that zipfile cannot open."""

import io

import numpy as np
import pytest

from skidpad.core.errors import FileError
from skidpad.core.files.reading import read_arrays

CENTRAL = b"PK\x01\x02"  # begins a member's entry of the central directory


@pytest.mark.parametrize(
    ("offset", "value", "says"), [(8, 1, "encrypted"), (10, 99, "compression")]
)
def test_a_locked_or_strangely_packed_file_is_refused_in_a_sentence(offset, value, says):
    file = io.BytesIO()
    np.savez_compressed(file, x=np.arange(3))
    data = bytearray(file.getvalue())
    data[data.rindex(CENTRAL) + offset] = value
    with pytest.raises(FileError, match=f"^map m.npz is not an .npz file: .*{says}") as refused:
        read_arrays(bytes(data), "map m.npz")
    assert "\n" not in str(refused.value)
