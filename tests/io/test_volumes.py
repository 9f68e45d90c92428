"""Test that reading and writing volumes keeps the position of each layer, row and column."""

from __future__ import annotations

import base64
import struct
import zlib
from contextlib import suppress
from io import BytesIO

import numpy as np
import pytest
from hypothesis import given, strategies as st

import ccwsim.io as cio
from ccwsim import CCWSIMError, Ensemble, Grid, HardData, Parameters, TrainingImage
from ccwsim.io.limits import UPLOAD_LIMITS, limited
from ccwsim.io.opening import open_file
from ccwsim.model.study import Study
from tests.io import sample_files as sample
from tests.small_images import noise

CODES = np.array([0, 4, 7])[noise((3, 4, 5), 3)]
IMAGE = TrainingImage(CODES, name="body")
PLACED = Grid(4, 5, (10.0, 20.0, 0.5), (350000.0, 4505000.0, -8.0), nz=3)

FILES = {
    "sgems": cio.training_image_as_bytes(IMAGE, "sgems"),
    "npy": cio.training_image_as_bytes(IMAGE, "npy"),
    "npz": sample.npz(ti=CODES),
    "mat": sample.mat(ti=np.moveaxis(CODES, 0, 2)),
    "vti": cio.maps_as_bytes({"facies": CODES}, PLACED, "vti"),
    "geone": cio.maps_as_bytes({"facies": CODES}, PLACED, "gslib"),
    "gslib": sample.gslib_table(CODES),
}
VALUES = {"p": np.linspace(0, 1, 60).reshape(3, 4, 5), "facies": CODES}


def read(content: bytes, **choices) -> np.ndarray:
    return cio.read_training_image(BytesIO(content), volume=True, **choices).array


def an_ensemble(grid: Grid = PLACED) -> Ensemble:
    data = HardData([[0, 3, 4], [0, 0, 1]], [7, 0])
    return Ensemble(
        Study(IMAGE, grid, Parameters((2, 4, 4), (1, 2, 2), (0, 1, 1)), data, 5, checked=False),
        indices=noise((2, *grid.shape), 3, seed=1),
        cpu_seconds=np.ones(2),
        wall_seconds=1.0,
        data_status=np.zeros((2, 2), np.int16),
        numbers=np.arange(2),
    )


class TestTrainingImages:
    @pytest.mark.parametrize("kind", FILES)
    def test_every_format_gives_every_cell(self, kind):
        choices = {"shape": CODES.shape} if kind == "gslib" else {}
        np.testing.assert_array_equal(read(FILES[kind], **choices), CODES)

    @pytest.mark.parametrize("kind", ["sgems", "npy", "mat", "vti"])
    def test_layers_rows_and_columns_turn_as_asked(self, kind):
        content = FILES[kind]
        np.testing.assert_array_equal(read(content, z_up=False), CODES[::-1])
        np.testing.assert_array_equal(read(content, z_up=True, up=False), CODES[:, ::-1])
        np.testing.assert_array_equal(read(content, transpose=True), np.swapaxes(CODES, 1, 2))
        piece = read(content, crop=(1, 2, 3, 2))
        np.testing.assert_array_equal(piece, CODES[:, 1:4, 2:4])
        np.testing.assert_array_equal(read(content, every=2), CODES[:, 0:4:2, 1:4:2])

    def test_text_lists_x_first_then_y_then_z(self):
        values = FILES["sgems"].split(b"\n")[3:-1]
        assert FILES["sgems"].startswith(b"5 4 3\n1\nfacies\n")
        assert [int(v) for v in values] == CODES.ravel().tolist()

    def test_one_layer_and_one_column_stay_a_volume(self):
        for shape in ((1, 4, 5), (3, 1, 5), (3, 4, 1)):
            image = TrainingImage(noise(shape, 2))
            assert read(cio.training_image_as_bytes(image, "sgems")).shape == shape

    def test_a_slice_is_taken_as_before(self):
        content = FILES["sgems"]
        one = cio.read_training_image(BytesIO(content), slice_index=2)
        np.testing.assert_array_equal(one.array, CODES[2])
        with pytest.raises(CCWSIMError, match="slice_index = 2 and volume=True exclude"):
            read(content, slice_index=2)
        np.testing.assert_array_equal(cio.read_grid(BytesIO(content), volume=True), CODES)

    def test_pictures_are_maps(self):
        with pytest.raises(CCWSIMError, match="a picture with one layer"):
            read(sample.picture())
        with pytest.raises(CCWSIMError, match="a PNG can show maps"):
            cio.training_image_as_bytes(IMAGE, "png")

    def test_a_promise_that_does_not_hold_says_both_numbers(self):
        content = FILES["sgems"].replace(b"5 4 3", b"5 4 4")
        with pytest.raises(CCWSIMError, match=r"5 × 4 × 4 cells .* 80 values, but 60 follow"):
            read(content)
        with pytest.raises(CCWSIMError, match=r"60 values, .* 5 × 4 × 2 cells"):
            read(FILES["gslib"], shape=(5, 4, 2))

    def test_sizes_are_looked_at_before_values(self):
        with limited(UPLOAD_LIMITS), pytest.raises(CCWSIMError, match="are more than 4000000"):
            read(b"999 999 999\n1\nfacies\n0\n")


class TestRealizations:
    @pytest.mark.parametrize("kind", ["npz", "gslib", "sgems", "vti", "nc"])
    def test_files_give_the_volumes_again(self, kind):
        if kind == "nc":
            xarray = pytest.importorskip("xarray")
            found = xarray.open_dataarray(BytesIO(cio.realizations_as_bytes(an_ensemble(), kind)))
            assert found.dims == ("realization", "z", "y", "x")
            np.testing.assert_array_equal(found, an_ensemble().realizations)
            return
        e = an_ensemble()
        again = cio.read_realizations(BytesIO(cio.realizations_as_bytes(e, kind)), IMAGE)
        np.testing.assert_array_equal(again.realizations, e.realizations)
        assert again.grid == e.grid
        if kind == "npz":
            assert again.parameters == e.parameters
            assert again.hard_data.triples == e.hard_data.triples
            assert again.training_image.digest == IMAGE.digest

    def test_arrays_of_four_dimensions_are_volumes(self):
        e = an_ensemble()
        content = sample.npy(np.asarray(e.realizations))
        for image in (None, IMAGE):
            again = cio.read_realizations(BytesIO(content), image)
            np.testing.assert_array_equal(again.realizations, e.realizations)
            assert again.grid.shape == PLACED.shape
        with pytest.raises(CCWSIMError, match="contains volumes, but the training image is a map"):
            cio.read_realizations(BytesIO(content), CODES[0])

    def test_arrays_of_three_dimensions_are_maps_unless_the_image_is_a_volume(self):
        content = sample.npy(CODES)
        assert cio.read_realizations(BytesIO(content)).realizations.shape == (3, 4, 5)
        assert cio.read_realizations(BytesIO(content), IMAGE).realizations.shape == (1, 3, 4, 5)

    @pytest.mark.parametrize("layers", [1, 3])
    def test_grids_in_text_have_a_volume_a_column(self, layers):
        e = an_ensemble(Grid(4, 5, nz=layers))
        again = cio.read_realizations(BytesIO(cio.realizations_as_bytes(e, "sgems")), IMAGE)
        np.testing.assert_array_equal(again.realizations, e.realizations)

    @pytest.mark.parametrize("kind", ["png", "tif"])
    def test_formats_of_maps_say_what_to_write_instead(self, kind):
        with pytest.raises(CCWSIMError, match="can show maps, not volumes"):
            cio.realizations_as_bytes(an_ensemble(), kind)


class TestMaps:
    @pytest.mark.parametrize("kind", ["npz", "gslib", "vti"])
    def test_probabilities_come_back(self, kind):
        content = cio.maps_as_bytes(VALUES, PLACED, kind)
        for name, own in VALUES.items():
            found = cio.read_grid(BytesIO(content), variable=name, volume=True)
            np.testing.assert_allclose(found, own, atol=1e-6)
        if kind != "npz":
            file = open_file(BytesIO(content))
            assert file.geometry.grid(CODES.shape) == PLACED

    def test_netcdf_has_z(self):
        xarray = pytest.importorskip("xarray")
        found = xarray.open_dataset(BytesIO(cio.maps_as_bytes(VALUES, PLACED, "nc")))
        assert found.p.dims == ("z", "y", "x")
        np.testing.assert_allclose(found.z, [-7.75, -7.25, -6.75])


def vtk(arrays: str, *, extent="0 5 0 4 0 3", more: str = "", appended: bytes = b"") -> bytes:
    """Return an ImageData file as written by other programs."""
    head = f'<VTKFile type="ImageData" byte_order="LittleEndian" {more}>'
    grid = f'<ImageData WholeExtent="{extent}" Origin="1 2 3" Spacing="2 2 0.5">'
    body = f'<Piece Extent="{extent}">{arrays}</Piece></ImageData>'
    return f"{head}{grid}{body}".encode() + appended + b"</VTKFile>"


class TestVtk:
    raw = CODES.astype("<i4").tobytes()

    def cells(self, form: str, text: str = "", offset: str = "") -> str:
        head = f'<DataArray type="Int32" Name="f" format="{form}"{offset}>'
        return f"<PointData/><CellData>{head}{text}</DataArray></CellData>"

    def packed(self, letters: bool) -> bytes:
        blocks = [zlib.compress(self.raw[k : k + 64]) for k in range(0, len(self.raw), 64)]
        head = struct.pack(f"<{3 + len(blocks)}I", len(blocks), 64, 48, *map(len, blocks))
        parts = head, b"".join(blocks)
        return b"".join(base64.b64encode(p) if letters else p for p in parts)

    def test_values_as_text(self):
        text = "\n".join(map(str, CODES.ravel().tolist()))
        np.testing.assert_array_equal(read(vtk(self.cells("ascii", text))), CODES)

    @pytest.mark.parametrize("together", [True, False])
    def test_values_in_letters(self, together):
        head = struct.pack("<I", len(self.raw))
        parts = [head + self.raw] if together else [head, self.raw]
        text = b"\n  ".join(base64.b64encode(part) for part in parts).decode()
        np.testing.assert_array_equal(read(vtk(self.cells("binary", text))), CODES)

    @pytest.mark.parametrize("letters", [True, False])
    @pytest.mark.parametrize("is_packed", [True, False])
    def test_values_behind_the_elements(self, letters, is_packed):
        own = struct.pack("<I", len(self.raw)) + self.raw
        data = base64.b64encode(own) if letters else own
        data = self.packed(letters) if is_packed else data
        encoding = b"base64" if letters else b"raw"
        appended = b'<AppendedData encoding="' + encoding + b'">\n_junk' + data + b"</AppendedData>"
        more = 'compressor="vtkZLibDataCompressor"' if is_packed else ""
        cells = self.cells("appended", offset=' offset="4"')
        np.testing.assert_array_equal(read(vtk(cells, more=more, appended=appended)), CODES)

    def test_values_of_points_stand_for_the_cells_around_them(self):
        text = " ".join(map(str, CODES.ravel().tolist()))
        points = f'<PointData><DataArray type="Float32" Name="f">{text}</DataArray></PointData>'
        content = vtk(points, extent="0 4 0 3 0 2")
        np.testing.assert_array_equal(read(content), CODES)
        placed = open_file(BytesIO(content)).geometry.grid(CODES.shape)
        assert (placed.origin, placed.cell_size) == ((0.0, 1.0, 2.75), (2.0, 2.0, 0.5))

    @pytest.mark.parametrize(
        ("content", "said"),
        [
            (vtk("<CellData/>"), "no array of real numbers"),
            (vtk("").replace(b"ImageData", b"PolyData"), "VTK PolyData of 0 pieces is not read"),
            (vtk("<CellData>"), "XML is broken"),
            (
                vtk("", more='compressor="vtkLZ4DataCompressor"').replace(b"Piece", b"Piece"),
                "compression by vtkLZ4",
            ),
            (vtk("", extent="0 1 0"), "must be 6 numbers"),
            (
                vtk("").replace(b"Spacing", b'Direction="0 1 0 1 0 0 0 0 1" Spacing'),
                "rotated grids",
            ),
            (b'<!DOCTYPE a [<!ENTITY b "c">]>' + vtk(""), "DOCTYPE"),
        ],
    )
    def test_what_cannot_be_read_is_said(self, content, said):
        with pytest.raises(CCWSIMError, match=said):
            read(content)

    def test_another_number_of_values_is_said_with_both(self):
        with pytest.raises(CCWSIMError, match="states 60 cells, but 2 values"):
            read(vtk(self.cells("ascii", "0 1")))
        text = base64.b64encode(struct.pack("<I", 8) + self.raw[:8]).decode()
        with pytest.raises(CCWSIMError, match="states 60 cells, but 2 values"):
            read(vtk(self.cells("binary", text)))

    def test_sizes_are_looked_at_before_values(self):
        content = vtk(self.cells("ascii", "0"), extent="0 99999 0 99999 0 99999")
        with pytest.raises(CCWSIMError, match="are more than"):
            read(content)

    @given(st.data())
    def test_a_changed_byte_is_read_or_refused(self, data):
        content = bytearray(cio.maps_as_bytes({"f": CODES}, PLACED, "vti"))
        at = data.draw(st.integers(0, len(content) - 1))
        content[at] = data.draw(st.integers(0, 255))
        with suppress(CCWSIMError):
            assert read(bytes(content)).ndim == 3
