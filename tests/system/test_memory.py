"""Memory that threads freed can be given back: they take it from a few places."""

from __future__ import annotations

import ctypes
import platform
import subprocess
import sys

import pytest

ARENAS = """
import ctypes, sys, threading
from ccwsim.system.memory import share_arenas
if len(sys.argv) > 1:
    share_arenas(int(sys.argv[1]))
all_there = threading.Barrier(24)
lib = ctypes.CDLL(None)
lib.malloc.restype = ctypes.c_void_p
def take():
    all_there.wait()
    held = [lib.malloc(40) for _ in range(100)]
    all_there.wait()
threads = [threading.Thread(target=take) for _ in range(24)]
for thread in threads: thread.start()
for thread in threads: thread.join()
lib.fopen.restype = ctypes.c_void_p
file = ctypes.c_void_p(lib.fopen(b"/dev/stdout", b"w"))
lib.malloc_info(0, file)
lib.fclose(file)
"""


def arenas(*n: int) -> int:
    command = [sys.executable, "-c", ARENAS, *map(str, n)]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return said.count("<heap nr=")


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="another C library")
def test_threads_share_a_few_places_for_small_pieces_of_memory():
    assert hasattr(ctypes.CDLL(None), "mallopt")
    assert arenas() > 3
    assert arenas(3) <= 3
