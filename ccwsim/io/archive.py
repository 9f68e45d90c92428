"""Check zip files, such as `.npz` and projects, before unpacking them."""

import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO

from ccwsim import CCWSIMError
from ccwsim.io.data_file import broken
from ccwsim.io.limits import check

_ENTRY = b"PK\x01\x02"
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


class Archive:
    """The members of a zip file by name; the names are never used as paths on disk."""

    def __init__(self, archive: zipfile.ZipFile, name: str) -> None:
        self._archive, self._name = archive, name
        self.infos = {info.filename: info for info in archive.infolist()}

    def check(self, members: list[str]) -> None:
        """Raise an error if members have an unknown compression or are too large when unpacked."""
        infos = [self.infos[member] for member in members]
        for info in infos:
            if info.compress_type not in _METHODS or info.flag_bits & 1:
                raise CCWSIMError(f"{self._name}: its compression is not supported; save it again")
        check(self._name, unpacked=sum(max(info.file_size, 0) for info in infos))

    def read(self, member: str) -> bytes:
        """Return a member's content, limited to the size stated in the zip's directory."""
        size = self.infos[member].file_size
        with self._archive.open(self.infos[member]) as file:
            content = file.read(size)
        if len(content) < size:
            raise EOFError("a member ends early")
        return content


@contextmanager
def opened_archive(content: bytes, name: str) -> Iterator[Archive]:
    """Yield the members of a zip file; raise an error if the file is broken."""
    check(name, members=content.count(_ENTRY))  # opening a zip creates an object for each entry
    with (
        broken(f"{name}: the zip file is broken; get the file again"),
        zipfile.ZipFile(BytesIO(content)) as archive,
    ):
        yield Archive(archive, name)
