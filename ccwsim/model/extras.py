"""Import packages that are installed only with an extra, or name the extra that is missing."""

from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ccwsim.model.errors import CCWSIMError, refused

OPTIONAL = {
    "streamlit": ("dashboard", "the dashboard needs"),
    "plotly": ("plot", "charts need"),
    "jinja2": ("plot", "reports need"),
    "rasterio": (
        "files",
        "GeoTIFF, Surfer, ZMap and GRASS files, and other coordinate systems, need",
    ),
    "xarray": ("files", "NetCDF files and labelled arrays need"),
    "h5py": ("files", "HDF5, MATLAB 7.3 and NetCDF-4 files need"),
    "h5netcdf": ("files", "NetCDF-4 files need"),
    "openpyxl": ("files", "Excel files need"),
    "pyogrio": ("files", "GeoPackage and Shapefile files need"),
    "flopy": ("modflow", "MODFLOW models need"),
    "distributed": ("dask", "a Dask scheduler needs"),
}
"""The extra that installs each optional package, and the reason why it is needed."""

IN_SOURCE_FOLDER = Path(__file__).parents[2].joinpath("pyproject.toml").is_file()
"""Whether the program runs from the source folder, where pip does not know the name `ccwsim`."""


def is_installed(package: str) -> bool:
    """Return whether an optional package is installed, without importing it."""
    return find_spec(package) is not None


def check_installed(package: str) -> None:
    """Raise an error that names the extra if an optional package is not installed."""
    if not is_installed(package):
        raise _missing(package)


def needs(package: str) -> Any:
    """Import and return an optional package; raise an error if it cannot be imported."""
    try:
        return import_module(package)
    except ImportError as error:
        raise _missing(package) from error


def _missing(package: str) -> CCWSIMError:
    extra, purpose = OPTIONAL[package.partition(".")[0]]
    return refused(
        "missing_package",
        purpose=purpose,
        package=package,
        target=f"{'.' if IN_SOURCE_FOLDER else 'ccwsim'}[{extra}]",
    )
