"""Formats that are recognized by their content but not read, each with a way to read its data."""

from __future__ import annotations

import re

_POINTS = "save its points as GeoJSON or CSV"
_GRID = "save its grid as GSLIB, GRDECL or ESRI ASCII"
_TABLE = "save its table as CSV"
_PICTURE = "save the picture itself as PNG"
_SURVEY = "save MD, AZIM and INCL as CSV, with a column of the well's name"
_SLICE = "save a slice as CSV or GSLIB"
_UNPACK = "unpack it and use the file in it"

UNREAD = (
    ("a legacy VTK file", rb"# vtk DataFile", "save it as .vti (VTK ImageData), as ParaView does"),
    ("a KML file", rb".{0,2000}<kml", _POINTS),
    ("a DXF file", rb"(\s*999\r?\n[^\n]*\n)*\s*0\r?\n\s*SECTION\r?\n|AutoCAD Binary DXF", _POINTS),
    ("a DWG file", rb"AC10\d\d\0", _POINTS),
    ("a dBASE table", rb"[\x03\x83\x30\xf5][\x50-\x99][\x01-\x0c][\x01-\x1f]", _TABLE),
    ("a GOCAD file", rb"\s*GOCAD \w+ ", _GRID),
    ("a CPS-3 grid", rb"\s*(![^\n]*\n\s*)*FS(ASCI|ATTR|LIMI|NROW)", _GRID),
    ("a ROFF file", rb"roff-(bin|asc)", _GRID),
    ("an Eclipse binary file", rb"\0\0\0\x10[A-Z0-9_ ]{8}.{4}(INTE|REAL|DOUB|LOGI|CHAR)", _GRID),
    ("an IRAP binary grid", rb"\0\0\0\x20\xff\xff\xfc\x1c", "save it as IRAP ASCII"),
    ("an SGeMS binary file", rb"\xb2\x11\x17\x5d", "save it in SGeMS as GSLIB"),
    ("an SEG-Y file", rb"\xc3[\x40\xf0]\xf1|C[ 0]1.{3197}.{0,60}\0", _SLICE),
    ("a Petrel well trace", rb"\s*# WELL TRACE FROM PETREL", _SURVEY),
    ("a DLIS well log", rb".{4}V[12]\.\d\dRECORD", "save it as LAS or CSV"),
    ("a LAS point cloud (lidar)", rb"LASF", "save its points as CSV"),
    ("an ERDAS Imagine raster", rb"EHFA_HEADER_TAG", "save it as GeoTIFF"),
    ("a JPEG 2000 picture", rb"\0\0\0\x0cjP  ", "save it as GeoTIFF or PNG"),
    ("a WebP picture", rb"RIFF.{4}WEBP", "save it as PNG"),
    ("a NIfTI image", rb".{344}(n\+1|ni1)\0", "save its array as npy"),
    ("a DICOM image", rb".{128}DICM", "save its slices as npy"),
    ("a Parquet table", rb"PAR1", _TABLE),
    ("a Feather table", rb"ARROW1|FEA1", _TABLE),
    ("a file of R", rb"RD[AX]\d\n", _TABLE),
    ("a pickle of Python", rb"\x80[\x02-\x05]", "save its arrays as npy or npz"),
    ("an old Excel or Office file", rb"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "save it as xlsx or CSV"),
    ("a PowerPoint file", rb"PK.*ppt/presentation", _PICTURE),
    ("a Word file", rb"PK.*word/document", f"{_PICTURE}, or its table as CSV"),
    ("an OpenDocument file", rb"PK.*mimetypeapplication/vnd\.oasis", _TABLE),
    ("a KMZ file", rb"PK.*\.kml", _POINTS),
    ("a PDF file", rb"%PDF-", f"{_PICTURE}, or its table as CSV"),
    ("a PostScript file", rb"%!PS", _PICTURE),
    ("an SVG drawing", rb".{0,1000}<svg", "save it as PNG"),
    ("a gzip file", rb"\x1f\x8b", _UNPACK),
    ("a 7z archive", rb"7z\xbc\xaf", _UNPACK),
    ("a RAR archive", rb"Rar!", _UNPACK),
    ("a zip archive without an array", rb"PK(?!.*\.npy)", _UNPACK),
    ("a web page", rb"(?i).{0,200}<(!doctype )?html", "download the file behind the link"),
    ("an XML file", rb"\s*<\?xml|\s*<\w+[ >]", _TABLE),
    ("a JSON file", rb"\s*[{\[]\s*[\"{\[\]}]", f"{_TABLE}, or its points as GeoJSON"),
)
"""Name, regular expression that the start matches, and remedy; special formats precede general."""
_START = 4096
_DIRECTORY = 65536
"""Number of bytes at the end of a zip that are searched for the names of its files."""


def refusal(content: bytes) -> str:
    """Return the name of a format that is not read, and a remedy; empty for unknown formats."""
    start = content[:_START] + (content[-_DIRECTORY:] if content.startswith(b"PK") else b"")
    fits = (f"{name}; {fix}" for name, mark, fix in UNREAD if re.match(mark, start, re.DOTALL))
    return next(fits, "")
