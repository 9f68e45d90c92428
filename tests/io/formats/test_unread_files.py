"""Test that recognized formats that cannot be read are named, with a way to read the data."""

from __future__ import annotations

from io import BytesIO
from zipfile import ZipFile

import pytest

from ccwsim import CCWSIMError
from ccwsim.io import opening, read_points, read_training_image
from ccwsim.io.opening import UNREAD, refusal
from tests.io import sample_files as sample


def zipped(*names: str) -> bytes:
    content = BytesIO()
    with ZipFile(content, "w") as file:
        for name in names:
            file.writestr(name, b"application/vnd.oasis" if name == "mimetype" else b"x")
    return content.getvalue()


CARD = b"C 1 CLIENT".ljust(3200)
FILES = {
    "a legacy VTK file": b"# vtk DataFile Version 3.0\nvtk\nBINARY\nPOINTS 1 float\n\0\0\0\0",
    "a KML file": b'<?xml version="1.0"?>\n<kml xmlns="http://www.opengis.net/kml/2.2"></kml>',
    "a DXF file": b"  0\r\nSECTION\r\n  2\r\nENTITIES\r\n  0\r\nPOINT\r\n",
    "a DWG file": b"AC1032\0\0\0\0",
    "a dBASE table": b"\x03\x7a\x07\x1a" + bytes(28),
    "a GOCAD file": b"GOCAD Voxet 1\nHEADER {\nname: a\n}\nAXIS_O 0 0 0\n",
    "a CPS-3 grid": b"! made by Petrel\nFSASCI 0 1 COMPUTED 0 1.0E30\nFSNROW 6 8\n1 2 3 4 5\n",
    "a ROFF file": b"roff-asc\n#ROFF file#\ntag filedata\n",
    "an Eclipse binary file": b"\0\0\0\x10FILEHEAD\0\0\0\x64INTE\0\0\0\x10",
    "an IRAP binary grid": b"\0\0\0\x20\xff\xff\xfc\x1c" + bytes(40),
    "an SEG-Y file": CARD.decode().encode("cp037") + bytes(400),
    "a Petrel well trace": b"# WELL TRACE FROM PETREL\n MD X Y Z AZIM INCL\n0 1 2 3 0 0\n",
    "a DLIS well log": b"0001V1.00RECORD08192Default" + bytes(60),
    "a LAS point cloud (lidar)": b"LASF\0\0" + bytes(200),
    "an ERDAS Imagine raster": b"EHFA_HEADER_TAG\0",
    "a JPEG 2000 picture": b"\0\0\0\x0cjP  \r\n\x87\n",
    "a WebP picture": b"RIFF\x24\0\0\0WEBPVP8 ",
    "a NIfTI image": b"\x5c\x01".ljust(344, b"\0") + b"n+1\0",
    "a DICOM image": bytes(127) + b"\x01DICM",
    "a Parquet table": b"PAR1\x15\0PAR1",
    "a Feather table": b"ARROW1\0\0",
    "a file of R": b"RDX3\nX\n\0",
    "a pickle of Python": b"\x80\x04\x95\0",
    "an old Excel or Office file": b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1\0",
    "a PowerPoint file": zipped("[Content_Types].xml", "ppt/presentation.xml"),
    "a Word file": zipped("[Content_Types].xml", "word/document.xml"),
    "an OpenDocument file": zipped("mimetype", "content.xml"),
    "a KMZ file": zipped("doc.kml"),
    "a PDF file": b"%PDF-1.4\n1 0 obj\n",
    "a PostScript file": b"%!PS-Adobe-3.0 EPSF-3.0\n1 2 3\n",
    "an SVG drawing": b'<svg xmlns="http://www.w3.org/2000/svg"></svg>',
    "a gzip file": b"\x1f\x8b\x08\0",
    "a 7z archive": b"7z\xbc\xaf\x27\x1c\0",
    "a RAR archive": b"Rar!\x1a\x07\0",
    "a zip archive without an array": zipped("facies.csv"),
    "a web page": b"<!DOCTYPE html>\n<html><body>404</body></html>",
    "an XML file": b'<?xml version="1.0"?><grid/>',
    "a JSON file": b'{"rows": [[0, 1], [1, 0]]}',
}
"""First bytes of a file of each format."""


@pytest.mark.parametrize(("name", "remedy"), [(name, remedy) for name, _, remedy in UNREAD])
def test_a_format_that_is_not_read_is_named_with_a_remedy(name, remedy):
    for read in (read_training_image, read_points):
        with pytest.raises(CCWSIMError) as told:
            read(BytesIO(FILES[name]))
        assert str(told.value) == f"file is {name}; {remedy}"


def test_a_text_of_seg_y_isrecognized():
    with pytest.raises(CCWSIMError, match="is an SEG-Y file"):
        read_training_image(BytesIO(CARD + bytes(400)))


def test_what_is_read_is_not_refused():
    everything = {**sample.training_images(), **sample.hard_data()}
    for name, content in everything.items():
        assert opening.recognized(content, name)[0] in opening.READERS
        assert opening.recognized(content, name)[0] not in opening._LAST or not refusal(content)


def test_another_grid_of_vtk_is_named():
    content = b'<?xml version="1.0"?><VTKFile type="RectilinearGrid"><RectilinearGrid/></VTKFile>'
    with pytest.raises(CCWSIMError, match=r"VTK RectilinearGrid .* is not read; save .*ImageData"):
        read_training_image(BytesIO(content))
