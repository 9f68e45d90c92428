"""Test that a file from outside makes no reader open another file or address."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest

from ccwsim import CCWSIMError
from ccwsim.io import inspect, read_training_image

VRT = """<VRTDataset rasterXSize="8" rasterYSize="8"><VRTRasterBand dataType="Byte" band="1">
<SimpleSource><SourceFilename relativeToVRT="0">{source}</SourceFilename><SourceBand>1</SourceBand>
<SrcRect xOff="0" yOff="0" xSize="8" ySize="8"/><DstRect xOff="0" yOff="0" xSize="8" ySize="8"/>
</SimpleSource></VRTRasterBand></VRTDataset>"""
WMS = """<GDAL_WMS><Service name="TMS"><ServerUrl>http://{source}/${{z}}</ServerUrl></Service>
<DataWindow><SizeX>8</SizeX><SizeY>8</SizeY></DataWindow><BandsCount>1</BandsCount></GDAL_WMS>"""


@pytest.fixture
def secret(tmp_path):
    """Return a raster on the machine that was not uploaded."""
    rasterio = pytest.importorskip("rasterio")
    path = tmp_path / "secret.tif"
    shape = {"width": 8, "height": 8, "count": 1, "dtype": "uint8"}
    shape["transform"] = rasterio.transform.from_origin(100, 900, 5, 5)
    with rasterio.open(path, "w", driver="GTiff", **shape) as file:
        file.write(np.eye(8, dtype=np.uint8), 1)
    return path


@pytest.mark.parametrize("name", ["a.vrt", "a.tif", "a.xml", "a", "/vsizip/a.zip/a.vrt"])
@pytest.mark.parametrize("way", ["{}", "/vsicurl/http://localhost:1/{}", "/vsizip/{}"])
def test_a_description_of_another_raster_is_refused(secret, name, way):
    for text in (VRT, WMS):
        file = BytesIO(text.format(source=way.format(secret)).encode())
        file.name = name
        with pytest.raises(CCWSIMError):
            inspect(file)


@pytest.mark.parametrize("name", ["/vsicurl/http://localhost:1/a.tif", "http://localhost:1/a.nc"])
def test_the_name_of_an_upload_is_only_a_name(secret, name):
    file = BytesIO(secret.read_bytes())
    file.name = name
    assert np.array_equal(read_training_image(file).array, np.eye(8)[::-1])


def test_a_name_beside_an_upload_is_not_looked_up(secret):
    """Test that GDAL reads neither NAME.aux.xml nor NAME.tfw beside an upload."""
    (secret.parent / "secret.tif.aux.xml").write_text(
        "<PAMDataset><PAMRasterBand band='1'><NoDataValue>1</NoDataValue></PAMRasterBand>"
        "</PAMDataset>"
    )
    file = BytesIO(secret.read_bytes())
    file.name = str(secret)
    assert read_training_image(file).array.sum() == 8


@pytest.mark.parametrize("formula", ["=[1]Sheet1!$A$1", "='file:///etc/[passwd]a'!A1"])
def test_a_link_of_a_spreadsheet_is_not_followed(formula):
    openpyxl = pytest.importorskip("openpyxl")
    book, content = openpyxl.Workbook(), BytesIO()
    book.active.append(["x", "y", "facies"])
    for row in ((1, 1, 0), (2, 2, 1), (3, 3, formula)):
        book.active.append(row)
    book.save(content)
    content.name = "a.xlsx"
    try:
        shown = repr(inspect(content))
    except CCWSIMError as error:
        shown = str(error)
    assert "root:" not in shown
