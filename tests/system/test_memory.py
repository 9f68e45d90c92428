"""Test that memory freed by threads returns to the system, because threads share few arenas."""

from __future__ import annotations

import ctypes
import platform
import subprocess
import sys

import pytest

ARENAS = """
import ctypes, sys, threading
from ccwsim.system.memory import settle_memory
if len(sys.argv) > 1:
    settle_memory(int(sys.argv[1]))
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


LARGE = """
import sys
from ccwsim.system.memory import give_back_memory, settle_memory, used_memory
import threading
import numpy as np
if len(sys.argv) > 1:
    settle_memory(int(sys.argv[1]))
before = used_memory()
def take():
    for n in (28, 7):  # after the first is freed, glibc allocates smaller blocks in an arena
        pieces = [np.ones(n << 20, np.uint8) for _ in range(5)]
        pieces.clear()
thread = threading.Thread(target=take)
thread.start()
thread.join()
give_back_memory()
print(used_memory() - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="another C library")
def test_freed_maps_go_back_to_the_system():
    def left(*n: int) -> int:
        command = [sys.executable, "-c", LARGE, *map(str, n)]
        return int(subprocess.run(command, capture_output=True, text=True, check=True).stdout)

    assert left(2) < 10 * 10**6 < left()
