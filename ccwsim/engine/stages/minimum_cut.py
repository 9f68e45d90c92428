"""The exact minimum cut of a volume's patch: the largest flow from old cells to new ones.

The cut pays, for each pair of neighbours of which one stays old and one is taken new, the cells of
the two that differ between old and new; beyond the overlap a cell counts as its neighbour does. The
cheapest cut is a largest flow (Ford and Fulkerson 1956), here found as Boykov and Kolmogorov (2004)
do: two trees of cells, one from the old cells and one from the new ones, grow until they meet; flow
goes along the way between them, and what it cuts off looks for another parent. Only cells that
differ and those between them take part: all others cost nothing on either side. Data are capacities
that no cheapest cut goes through, as long as they do not contradict each other.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.kernels import part_of_kernel
from ccwsim.engine.stages.box import ABOVE, BELOW, BOTTOM, LEFT, RIGHT, TOP, inside_overlap
from ccwsim.engine.stages.demand import KEEP_OLD, UNKNOWN, wanted
from ccwsim.engine.stages.path import Triple

SAME, DIFFERS, ALL_NEW, ALL_OLD, NOTHING = 0, 1, 2, 3, 4
"""A cell whose facies stays or changes; beyond the overlap: inside, outside of it, no neighbour."""
BROKEN_CELL = 1 << 20
"""What a cut pays for a datum it would drop: more than all seams of a patch."""
TREE, PARENT, DISTANCE, TIME = 0, 1, 2, 3
"""What `FlowWorkspace.node` has of each cell."""
FREE, OF_OLD, OF_NEW, INACTIVE = 0, 1, 2, 3
"""The tree that a cell is in; inactive cells take no part."""
ROOT, ORPHAN, NONE = 6, 7, 8
"""Parents that are no direction: of a cell that is joined to old or new cells itself, of one that
was cut off, and of one in no tree."""
FAR = 1 << 30


class FlowWorkspace(NamedTuple):
    """Arrays for the cut of one box, with a margin of one cell on each side."""

    state: NDArray[np.uint8]
    beside: NDArray[np.uint8]  # how many of the six neighbours differ
    # shape (n, 8): to the neighbour in each of six directions; side by side in memory
    capacity: NDArray[np.uint8]
    rest: NDArray[np.int32]  # capacity left: from the old cells, or where negative to the new ones
    # shape (n, 4): the tree of each cell, the direction of its parent, steps to the root, and when
    # these were counted; side by side in memory, as they are read together
    node: NDArray[np.int32]
    # cells that take part; those whose neighbours are to be looked at, in a ring; and cells cut off
    cells: NDArray[np.int32]
    queue: NDArray[np.int32]
    is_queued: NDArray[np.bool_]
    orphans: NDArray[np.int32]


def make_flow(template: Triple) -> FlowWorkspace:
    """Return the workspace for boxes of at most `template` cells; empty for none."""
    nz, ny, nx = template
    n = (nz + 2) * (ny + 2) * (nx + 2) if nz else 0
    state, beside, capacity, node = (
        np.zeros(n, np.uint8),
        np.zeros(n, np.uint8),
        np.zeros((n, 8), np.uint8),
        np.zeros((n, 4), np.int32),
    )
    rest, cells, queue, orphans = (np.zeros(n, np.int32) for _ in range(4))
    is_queued = np.zeros(n, np.bool_)
    return FlowWorkspace(state, beside, capacity, rest, node, cells, queue, is_queued, orphans)


@part_of_kernel
def minimum_cut(grid, data, image, place, box, flow, keep_mask):
    """Mark in `keep_mask`, all False on entry, the cells of a box where the grid stays.

    Returns the cost of the cut.
    """
    row = box.nx + 2
    layer = row * (box.ny + 2)
    steps = (-1, 1, -row, row, -layer, layer)
    _mark_states(grid, image, place, box, flow)
    _count_beside(box, row, layer, flow)
    n, total = _make_graph(grid, data, image, place, box, steps, flow)
    total += _largest_flow(n, steps, flow)
    for k in range(n):
        u = flow.cells[k]
        if flow.node[u, TREE] == OF_OLD:
            _keep(u, box, keep_mask)
            for a in range(6):  # cells left out of the graph stay with their only such neighbour
                v = u + steps[a]
                if flow.state[u] == DIFFERS and flow.state[v] == SAME and flow.beside[v] < 2:
                    _keep(v, box, keep_mask)
    return total


@part_of_kernel
def _keep(u, box, keep_mask):
    """Mark the cell at flat index `u` of the box with its margin."""
    z_row, x = divmod(u, box.nx + 2)
    z, y = divmod(z_row, box.ny + 2)
    keep_mask[z - 1, y - 1, x - 1] = True


@part_of_kernel
def _mark_states(grid, image, place, box, flow):
    """Set the state of each cell of the box and of the margin around it."""
    tz, ty, tx = place
    low_z, high_z, low_y, high_y, low_x, high_x = inside_overlap(box)
    below, above = box.sides & BELOW, box.sides & ABOVE
    top, bottom = box.sides & TOP, box.sides & BOTTOM
    left, right = box.sides & LEFT, box.sides & RIGHT
    u = 0
    for z in range(-1, box.nz + 1):
        for y in range(-1, box.ny + 1):
            outside = z < 0 or z == box.nz or y < 0 or y == box.ny
            old = (z < 0 and below) or (z == box.nz and above)
            old = old or (y < 0 and top) or (y == box.ny and bottom)
            if outside:
                for x in range(box.nx + 2):
                    flow.state[u + x] = ALL_OLD if old else NOTHING
            else:
                flow.state[u] = ALL_OLD if left else NOTHING
                flow.state[u + box.nx + 1] = ALL_OLD if right else NOTHING
                before, after = grid[box.z0 + z, box.y0 + y], image[tz + z, ty + y]
                first, x0, tx0 = np.uint64(u + 1), np.uint64(box.x0), np.uint64(tx)
                for k in range(np.uint64(box.nx)):
                    x = np.uint64(k)
                    flow.state[first + x] = before[x0 + x] != after[tx0 + x]
                if low_z <= z < high_z and low_y <= y < high_y:
                    for x in range(low_x, high_x):
                        flow.state[u + 1 + x] = ALL_NEW
            for x in range(box.nx + 2):
                flow.node[u + x, TREE] = INACTIVE
            u += box.nx + 2


@part_of_kernel
def _count_beside(box, row, layer, flow):
    """Count for each cell of the box how many of its neighbours differ between old and new."""
    state, beside, n = flow.state, flow.beside, np.uint64(box.nx)
    for z in range(1, box.nz + 1):
        for y in range(1, box.ny + 1):
            u = np.uint64(z * layer + y * row + 1)
            left, right = u - np.uint64(1), u + np.uint64(1)
            top, bottom = u - np.uint64(row), u + np.uint64(row)
            below, above = u - np.uint64(layer), u + np.uint64(layer)
            for x in range(n):
                k = np.uint64(x)
                found = np.uint8(0)
                for v in (left, right, top, bottom, below, above):
                    found += np.uint8(state[v + k] == DIFFERS)
                beside[u + k] = np.uint8(found)


@part_of_kernel
def _make_graph(grid, data, image, place, box, steps, flow):
    """Set the capacities of the cells that differ and their neighbours.

    Returns how many these are, and the flow through single cells.
    """
    tz, ty, tx = place
    state, n, total = flow.state, 0, np.int64(0)
    for z in range(box.nz):
        for y in range(box.ny):
            first = ((z + 1) * (box.ny + 2) + y + 1) * (box.nx + 2) + 1
            for x in range(box.nx):
                u = first + x
                own = np.int32(state[u])
                if own > DIFFERS:
                    continue
                if own == SAME and flow.beside[u] < 2:
                    continue  # nothing flows through a cell with one way in
                source, sink = np.int32(0), np.int32(0)
                for a in range(6):
                    other = np.int32(state[u + steps[a]])
                    free = other <= DIFFERS
                    flow.capacity[u, a] = own + other if free else 0
                    sink += 2 * own if other == ALL_NEW else 0
                    source += 2 * own if other == ALL_OLD else 0
                datum = data[box.z0 + z, box.y0 + y, box.x0 + x]
                if own == DIFFERS and datum != UNKNOWN:
                    old = grid[box.z0 + z, box.y0 + y, box.x0 + x]
                    demand = wanted(old, image[tz + z, ty + y, tx + x], datum)
                    if demand:
                        if demand == KEEP_OLD:
                            source += BROKEN_CELL
                        else:
                            sink += BROKEN_CELL
                through = min(source, sink)
                total += through
                flow.rest[u] = source - sink
                flow.cells[n] = u
                n += 1
    return n, total


@part_of_kernel
def _largest_flow(n, steps, flow):
    """Send all flow from old to new cells; return how much goes through more than one cell.

    In the end the tree of the old cells has all that flow from them could still reach.
    """
    node, queue, is_queued = flow.node, flow.queue, flow.is_queued
    size, head, tail, total, now = len(queue), 0, 0, np.int64(0), np.int32(1)
    for k in range(n):
        u = flow.cells[k]
        node[u, TIME], is_queued[u] = 0, False
        node[u, TREE], node[u, PARENT] = FREE, NONE
        if flow.rest[u] != 0:
            node[u, TREE] = OF_OLD if flow.rest[u] > 0 else OF_NEW
            node[u, PARENT], node[u, DISTANCE] = ROOT, 1
            queue[tail], is_queued[u] = u, True
            tail += 1
    n_queued = tail
    while n_queued > 0:
        u = queue[head]
        if node[u, TREE] == FREE:
            is_queued[u] = False
            head = head + 1 if head + 1 < size else 0
            n_queued -= 1
            continue
        meets = -1
        for a in range(6):
            v = u + steps[a]
            if node[v, TREE] == INACTIVE:
                continue
            if node[u, TREE] == OF_OLD:
                left = flow.capacity[u, a]
            else:
                left = flow.capacity[v, a ^ 1]
            if left == 0:
                continue
            if node[v, TREE] == FREE:
                node[v, TREE], node[v, PARENT] = node[u, TREE], a ^ 1
                node[v, TIME], node[v, DISTANCE] = node[u, TIME], node[u, DISTANCE] + 1
                if not is_queued[v]:
                    queue[tail], is_queued[v] = v, True
                    tail = tail + 1 if tail + 1 < size else 0
                    n_queued += 1
            elif node[v, TREE] != node[u, TREE]:
                meets = a
                break
            elif node[v, TIME] <= node[u, TIME] and node[v, DISTANCE] > node[u, DISTANCE]:
                node[v, PARENT] = a ^ 1  # a shorter way to the root
                node[v, TIME], node[v, DISTANCE] = node[u, TIME], node[u, DISTANCE] + 1
        if meets < 0:
            is_queued[u] = False
            head = head + 1 if head + 1 < size else 0
            n_queued -= 1
            continue
        now += 1
        v = u + steps[meets]
        old, new, a = (u, v, meets) if node[u, TREE] == OF_OLD else (v, u, meets ^ 1)
        n_orphans, amount = _augment(old, new, a, steps, flow)
        total += amount
        while n_orphans > 0:
            n_orphans -= 1
            n_orphans, tail, n_queued = _adopt(
                flow.orphans[n_orphans], n_orphans, tail, n_queued, now, steps, flow
            )
    return total


@part_of_kernel
def _augment(old, new, meets, steps, flow):
    """Send flow from root to root over the link in direction `meets` from `old` to `new`.

    Returns how many cells were cut off by it, and how much it is.
    """
    capacity, node, rest, orphans = flow.capacity, flow.node, flow.rest, flow.orphans
    amount, u = capacity[old, meets], old
    while node[u, PARENT] != ROOT:
        a = node[u, PARENT]
        u += steps[a]
        amount = min(amount, capacity[u, a ^ 1])
    amount, u = min(amount, rest[u]), new
    while node[u, PARENT] != ROOT:
        a = node[u, PARENT]
        amount = min(amount, capacity[u, a])
        u += steps[a]
    amount = min(amount, -rest[u])
    n = 0
    capacity[old, meets] -= amount
    capacity[new, meets ^ 1] += amount
    u = old
    while node[u, PARENT] != ROOT:
        a, child = node[u, PARENT], u
        u += steps[a]
        capacity[u, a ^ 1] -= amount
        capacity[child, a] += amount
        if capacity[u, a ^ 1] == 0:
            node[child, PARENT], orphans[n] = ORPHAN, child
            n += 1
    rest[u] -= amount
    if rest[u] == 0:
        node[u, PARENT], orphans[n] = ORPHAN, u
        n += 1
    u = new
    while node[u, PARENT] != ROOT:
        a, child = node[u, PARENT], u
        u += steps[a]
        capacity[child, a] -= amount
        capacity[u, a ^ 1] += amount
        if capacity[child, a] == 0:
            node[child, PARENT], orphans[n] = ORPHAN, child
            n += 1
    rest[u] += amount
    if rest[u] == 0:
        node[u, PARENT], orphans[n] = ORPHAN, u
        n += 1
    return n, amount


@part_of_kernel
def _adopt(u, n_orphans, tail, n_queued, now, steps, flow):
    """Find a cell that was cut off another parent in its tree, the nearest to the root, or free it.

    Returns how many cells are cut off now, and the end and length of the queue.
    """
    node, capacity, queue = flow.node, flow.capacity, flow.queue
    own, nearest, best = node[u, TREE], FAR, NONE
    for a in range(6):
        v = u + steps[a]
        if node[v, TREE] != own or node[v, PARENT] == ORPHAN:
            continue
        left = capacity[v, a ^ 1] if own == OF_OLD else capacity[u, a]
        if left == 0:
            continue
        distance, w = 0, v
        while True:  # up to the root, or to where the way is known
            if node[w, TIME] == now:
                distance += node[w, DISTANCE]
                break
            distance += 1
            if node[w, PARENT] == ROOT:
                node[w, TIME], node[w, DISTANCE] = now, 1
                break
            if node[w, PARENT] == ORPHAN:
                distance = FAR
                break
            w += steps[node[w, PARENT]]
        if distance >= FAR:
            continue
        if distance < nearest:
            nearest, best = distance, a
        w = v
        while node[w, TIME] != now:
            node[w, TIME], node[w, DISTANCE] = now, distance
            distance -= 1
            w += steps[node[w, PARENT]]
    node[u, PARENT] = best
    if best != NONE:
        node[u, TIME], node[u, DISTANCE] = now, nearest + 1
        return n_orphans, tail, n_queued
    for a in range(6):
        v = u + steps[a]
        if node[v, TREE] != own:
            continue
        left = capacity[v, a ^ 1] if own == OF_OLD else capacity[u, a]
        if left > 0 and not flow.is_queued[v]:
            queue[tail], flow.is_queued[v] = v, True
            tail = tail + 1 if tail + 1 < len(queue) else 0
            n_queued += 1
        if node[v, PARENT] < ROOT and v + steps[node[v, PARENT]] == u:
            node[v, PARENT] = ORPHAN
            flow.orphans[n_orphans] = v
            n_orphans += 1
    node[u, TREE] = FREE
    return n_orphans, tail, n_queued
