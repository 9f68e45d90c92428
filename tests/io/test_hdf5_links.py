"""Test that an HDF5 file from outside cannot include other files of the machine."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest

from ccwsim import CCWSIMError
from ccwsim.io import inspect

h5py = pytest.importorskip("h5py")


@pytest.mark.parametrize("kind", ["external array", "external link", "virtual array"])
def test_arrays_in_other_files_are_refused(kind, tmp_path):
    other = tmp_path / "other.h5"
    with h5py.File(other, "w") as file:
        file["secret"] = np.eye(4)
    (tmp_path / "raw").write_bytes(bytes(range(16)))
    hostile = tmp_path / "hostile.h5"
    with h5py.File(hostile, "w") as file:
        if kind == "external array":
            place = [(str(tmp_path / "raw"), 0, 16)]
            file.create_dataset("ti", (4, 4), "u1", external=place)
        elif kind == "external link":
            file["ti"] = h5py.ExternalLink(str(other), "secret")
        else:
            layout = h5py.VirtualLayout((4, 4), "f8")
            layout[:] = h5py.VirtualSource(str(other), "secret", (4, 4))
            file.create_virtual_dataset("ti", layout)
    with pytest.raises(CCWSIMError, match="refers to other files"):
        inspect(BytesIO(hostile.read_bytes()))
