"""The exact minimum cut of a patch of a volume, computed as the maximum flow from old to new cells.

A cut passes between two neighbouring cells if one stays old and the other becomes new. A cut
between two cells costs 1 for each of the two cells whose old and new facies differ; a cell beyond
the overlap counts like its neighbour. The cost of the cheapest cut equals a maximum flow (Ford and
Fulkerson 1956), which is computed by the method of Boykov and Kolmogorov (2004). A tree of old
cells and a tree of new cells grow until they touch. Flow is then sent from the root of the old tree
to the root of the new tree. A cell that loses the link to its tree gets another parent or leaves
the tree. Cells that add no cost on either side of the cut are omitted. The capacities of data are
so large that the cheapest cut honours all data that do not conflict.
"""

from typing import NamedTuple

import numpy as np

from ccwsim.engine.kernels import part_of_kernel
from ccwsim.engine.stages.conditioning import KEEP_OLD, forced_side
from ccwsim.engine.stages.path import (
    ABOVE,
    BELOW,
    BOTTOM,
    LEFT,
    RIGHT,
    TOP,
    UNKNOWN,
    Triple,
    inside_overlap,
)
from ccwsim.model import Bytes, Int32s, Mask, UInt32s

SAME_FACIES, DIFFERENT_FACIES, ALL_NEW, ALL_OLD, MISSING_CELL = 0, 1, 2, 3, 4
"""States of cells. SAME_FACIES and DIFFERENT_FACIES are cells in the overlap whose old and new
facies are equal or different. ALL_NEW, ALL_OLD and MISSING_CELL are new, old and missing cells
beyond the overlap."""
BROKEN_CELL = 1 << 20
"""Cost of a datum that the cut does not honour; it exceeds the cost of all seams of a patch."""
FREE, OF_OLD, OF_NEW, INACTIVE = 0, 1, 2, 3
"""Tree to which a cell belongs: none yet, the tree of old cells, or the tree of new cells. INACTIVE
marks cells that are omitted."""
TREE_ROOT, ORPHAN, NO_TREE = 6, 7, 8
"""Values of `parent` for a cell without a parent: the cell is a root, was cut off from a tree, or
is in no tree. Other values of `parent` are directions, 0 to 5."""
UNREACHED = 1 << 30


class FlowWorkspace(NamedTuple):
    """Workspace to cut a box of n cells, which include a margin of one cell on each side."""

    state: Bytes  # shape (n,)
    beside: Bytes  # shape (n,): number of neighbours that DIFFER
    capacity: Bytes  # shape (8 * n,): capacity of each link, see `_link`
    # shape (n,): remaining capacity, from the old cells if positive, to the new cells if negative
    remaining: Int32s
    tree: Bytes  # shape (n,)
    parent: Bytes  # shape (n,): direction of the parent
    distance: Int32s  # shape (n,): number of steps to the root of the tree
    time: Int32s  # shape (n,): time when `distance` was computed
    cells: UInt32s  # shape (n,): cells that are not omitted
    queue: UInt32s  # shape (n,), circular: cells whose neighbours are to be visited
    is_queued: Mask  # shape (n,)
    orphans: UInt32s  # shape (n,): cells that were cut off from their tree


def make_flow(template: Triple) -> FlowWorkspace:
    """Return the workspace to cut boxes of at most `template` cells."""
    nz, ny, nx = template
    n = (nz + 2) * (ny + 2) * (nx + 2) if nz else 0
    return FlowWorkspace(
        state=np.zeros(n, np.uint8),
        beside=np.zeros(n, np.uint8),
        capacity=np.zeros(8 * n, np.uint8),
        remaining=np.zeros(n, np.int32),
        tree=np.zeros(n, np.uint8),
        parent=np.zeros(n, np.uint8),
        distance=np.zeros(n, np.int32),
        time=np.zeros(n, np.int32),
        cells=np.zeros(n, np.uint32),
        queue=np.zeros(n, np.uint32),
        is_queued=np.zeros(n, np.bool_),
        orphans=np.zeros(n, np.uint32),
    )


@part_of_kernel
def minimum_cut(grid, data, image, place, box, flow, keep_mask):
    """Mark in `keep_mask` the cells of a box that stay old; return the cost of the cut.

    The arguments are documented in `keep_old`.
    """
    row, layer = box.nx + 2, (box.nx + 2) * (box.ny + 2)
    back, down, below = np.uint64(-1), np.uint64(-row), np.uint64(-layer)
    steps = (back, np.uint64(1), down, np.uint64(row), below, np.uint64(layer))
    _mark_states(grid, image, place, box, flow)
    _count_beside(box, row, layer, flow)
    n, total = _make_graph(grid, data, image, place, box, steps, flow)
    total += _largest_flow(n, steps, flow)
    for k in range(n):
        u = np.uint64(flow.cells[k])
        if flow.tree[u] == OF_OLD and flow.state[u] == DIFFERENT_FACIES:
            for a in range(6):  # an omitted cell joins its only neighbour that differs
                v = u + steps[a]
                if flow.state[v] == SAME_FACIES and flow.beside[v] < 2:
                    flow.tree[v] = OF_OLD
    keep = keep_mask.reshape(-1)
    for z in range(box.nz):
        for y in range(box.ny):
            first = np.uint64((z + 1) * layer + (y + 1) * row + 1)
            to = np.uint64((z * keep_mask.shape[1] + y) * keep_mask.shape[2])
            for x in range(np.uint64(box.nx)):
                keep[to + x] = flow.tree[first + x] == OF_OLD
    return total


@part_of_kernel
def _mark_states(grid, image, place, box, flow):
    """Set the state of each cell of the box and of the margin around the box."""
    tz, ty, tx = place
    low_z, high_z, low_y, high_y, low_x, high_x = inside_overlap(box)
    below, above = box.sides & BELOW, box.sides & ABOVE
    top, bottom = box.sides & TOP, box.sides & BOTTOM
    west, east = box.sides & LEFT, box.sides & RIGHT
    state, row = flow.state, np.uint64(box.nx + 2)
    of_grid, of_image = grid.reshape(-1), image.reshape(-1)
    _, ny, nx = grid.shape
    _, my, mx = image.shape
    u = np.uint64(0)
    for z in range(-1, box.nz + 1):
        for y in range(-1, box.ny + 1):
            outside = z < 0 or z == box.nz or y < 0 or y == box.ny
            old = (z < 0 and below) or (z == box.nz and above)
            old = old or (y < 0 and top) or (y == box.ny and bottom)
            for x in range(row):
                flow.tree[u + x] = INACTIVE
            if outside:
                for x in range(row):
                    state[u + x] = ALL_OLD if old else MISSING_CELL
            else:
                state[u] = ALL_OLD if west else MISSING_CELL
                state[u + row - np.uint64(1)] = ALL_OLD if east else MISSING_CELL
                to = u + np.uint64(1)
                first = np.uint64(((box.z0 + z) * ny + box.y0 + y) * nx + box.x0)
                new = np.uint64(((tz + z) * my + ty + y) * mx + tx)
                for x in range(np.uint64(box.nx)):
                    state[to + x] = of_grid[first + x] != of_image[new + x]
                if low_z <= z < high_z and low_y <= y < high_y:
                    for x in range(np.uint64(low_x), np.uint64(high_x)):
                        state[to + x] = ALL_NEW
            u += row


@part_of_kernel
def _count_beside(box, row, layer, flow):
    """Count, for each cell of the box, the neighbours whose facies differ between old and new."""
    state, beside, n = flow.state, flow.beside, np.uint64(box.nx)
    for z in range(1, box.nz + 1):
        for y in range(1, box.ny + 1):
            u = np.uint64(z * layer + y * row + 1)
            before, after = u - np.uint64(1), u + np.uint64(1)
            top, bottom = u - np.uint64(row), u + np.uint64(row)
            below, above = u - np.uint64(layer), u + np.uint64(layer)
            for x in range(n):
                k = np.uint64(x)
                n_different = np.uint8(0)
                for v in (before, after, top, bottom, below, above):
                    n_different += np.uint8(state[v + k] == DIFFERENT_FACIES)
                beside[u + k] = np.uint8(n_different)


@part_of_kernel
def _make_graph(grid, data, image, place, box, steps, flow):
    """Set the link capacities of all cells that take part in the cut.

    Return the number of cells that take part, and the flow that passes through only one cell.
    """
    tz, ty, tx = place
    state, n, total = flow.state, 0, np.int64(0)
    for z in range(box.nz):
        for y in range(box.ny):
            first = np.uint64(((z + 1) * (box.ny + 2) + y + 1) * (box.nx + 2) + 1)
            for x in range(box.nx):
                u = first + np.uint64(x)
                cell_state = np.int32(state[u])
                if cell_state > DIFFERENT_FACIES:
                    continue
                if cell_state == SAME_FACIES and flow.beside[u] < 2:
                    continue  # no flow passes through a cell with a link on only one side
                source, sink = np.int32(0), np.int32(0)
                for a in range(6):
                    other = np.int32(state[u + steps[a]])
                    free = other <= DIFFERENT_FACIES
                    flow.capacity[_link(u, a)] = cell_state + other if free else 0
                    sink += 2 * cell_state if other == ALL_NEW else 0
                    source += 2 * cell_state if other == ALL_OLD else 0
                datum = data[box.z0 + z, box.y0 + y, box.x0 + x]
                if cell_state == DIFFERENT_FACIES and datum != UNKNOWN:
                    old = grid[box.z0 + z, box.y0 + y, box.x0 + x]
                    side = forced_side(old, image[tz + z, ty + y, tx + x], datum)
                    if side:
                        if side == KEEP_OLD:
                            source += BROKEN_CELL
                        else:
                            sink += BROKEN_CELL
                through = min(source, sink)
                total += through
                flow.remaining[u] = source - sink
                flow.cells[n] = u
                n += 1
    return n, total


@part_of_kernel
def _link(u, a):
    """Return the number of the link from a cell to its neighbour in direction `a`."""
    return u << np.uint64(3) | np.uint64(a)


@part_of_kernel
def _largest_flow(n, steps, flow):
    """Send the maximum flow from old to new cells; return the flow through several cells.

    At the end, the tree of the old cells contains all cells that additional flow could reach.
    """
    tree, parent, distance, time = flow.tree, flow.parent, flow.distance, flow.time
    capacity, queue, is_queued = flow.capacity, flow.queue, flow.is_queued
    size, head, tail, total, now = len(queue), 0, 0, np.int64(0), np.int32(1)
    for k in range(n):
        u = np.uint64(flow.cells[k])
        time[u], is_queued[u] = 0, False
        tree[u], parent[u] = FREE, NO_TREE
        if flow.remaining[u] != 0:
            tree[u] = OF_OLD if flow.remaining[u] > 0 else OF_NEW
            parent[u], distance[u] = TREE_ROOT, 1
            queue[tail], is_queued[u] = u, True
            tail += 1
    n_queued = tail
    while n_queued > 0:
        u = np.uint64(queue[head])
        own_tree = tree[u]
        meets = -1
        for a in range(6 if own_tree != FREE else 0):
            v = u + steps[a]
            other = tree[v]
            if other == INACTIVE:
                continue
            residual = capacity[_link(u, a)] if own_tree == OF_OLD else capacity[_link(v, a ^ 1)]
            if residual == 0:
                continue
            if other == FREE:
                tree[v], parent[v] = own_tree, a ^ 1
                time[v], distance[v] = time[u], distance[u] + 1
                if not is_queued[v]:
                    queue[tail], is_queued[v] = v, True
                    tail = tail + 1 if tail + 1 < size else 0
                    n_queued += 1
            elif other != own_tree:
                meets = a
                break
            elif time[v] <= time[u] and distance[v] > distance[u]:
                parent[v] = a ^ 1  # the path from `v` to the root through `u` is shorter
                time[v], distance[v] = time[u], distance[u] + 1
        if meets < 0:
            is_queued[u] = False
            head = head + 1 if head + 1 < size else 0
            n_queued -= 1
            continue
        now += 1
        v = u + steps[meets]
        if own_tree == OF_OLD:
            n_orphans, amount = _augment(u, v, meets, steps, flow)
        else:
            n_orphans, amount = _augment(v, u, meets ^ 1, steps, flow)
        total += amount
        while n_orphans > 0:
            n_orphans -= 1
            n_orphans, tail, n_queued = _adopt(
                np.uint64(flow.orphans[n_orphans]), n_orphans, tail, n_queued, now, steps, flow
            )
    return total


@part_of_kernel
def _augment(old, new, meets, steps, flow):
    """Send flow between two roots through the link from `old` to `new` in direction `meets`.

    Return the number of cells that the flow cuts off from their tree, and the amount of flow.
    """
    there, back = _link(old, meets), _link(new, meets ^ 1)
    amount = _free_capacity(old, np.int32(flow.capacity[there]), True, steps, flow)
    amount = _free_capacity(new, amount, False, steps, flow)
    flow.capacity[there] -= amount
    flow.capacity[back] += amount
    n = _send(old, amount, 0, True, steps, flow)
    return _send(new, amount, n, False, steps, flow), amount


@part_of_kernel
def _free_capacity(u, amount, of_old, steps, flow):
    """Return the flow, at most `amount`, that can pass between a cell and its root."""
    while flow.parent[u] != TREE_ROOT:
        a, child = np.int64(flow.parent[u]), u
        u += steps[a]
        link = _link(u, a ^ 1) if of_old else _link(child, a)
        amount = min(amount, np.int32(flow.capacity[link]))
    return min(amount, abs(flow.remaining[u]))


@part_of_kernel
def _send(u, amount, n, of_old, steps, flow):
    """Send flow between a cell and its root, and list the cells that are cut off after the first n.

    Return the new number of cells that are cut off.
    """
    capacity, parent, orphans = flow.capacity, flow.parent, flow.orphans
    while parent[u] != TREE_ROOT:
        a, child = np.int64(parent[u]), u
        u += steps[a]
        there, back = _link(u, a ^ 1), _link(child, a)
        if not of_old:
            there, back = back, there
        capacity[there] -= amount
        capacity[back] += amount
        if capacity[there] == 0:
            parent[child], orphans[n] = ORPHAN, child
            n += 1
    flow.remaining[u] -= amount if of_old else -amount
    if flow.remaining[u] == 0:
        parent[u], orphans[n] = ORPHAN, u
        n += 1
    return n


@part_of_kernel
def _adopt(u, n_orphans, tail, n_queued, now, steps, flow):
    """Link an orphan to a neighbour near the root of its tree, or free the orphan.

    Return the new number of orphans, and the end and the length of the queue of active cells.
    """
    tree, parent, distance, time = flow.tree, flow.parent, flow.distance, flow.time
    capacity, queue = flow.capacity, flow.queue
    own_tree, nearest, best = tree[u], UNREACHED, NO_TREE
    for a in range(6):
        v = u + steps[a]
        if tree[v] != own_tree or parent[v] == ORPHAN:
            continue
        residual = capacity[_link(v, a ^ 1)] if own_tree == OF_OLD else capacity[_link(u, a)]
        if residual == 0:
            continue
        steps_up, w = 0, v
        while True:  # follow parents to the root, or to a cell whose distance is up to date
            if time[w] == now:
                steps_up += distance[w]
                break
            steps_up += 1
            if parent[w] == TREE_ROOT:
                time[w], distance[w] = now, 1
                break
            if parent[w] == ORPHAN:
                steps_up = UNREACHED
                break
            w += steps[np.int64(parent[w])]
        if steps_up >= UNREACHED:
            continue
        if steps_up < nearest:
            nearest, best = steps_up, a
        w = v
        while time[w] != now:
            time[w], distance[w] = now, steps_up
            steps_up -= 1
            w += steps[np.int64(parent[w])]
    parent[u] = best
    if best != NO_TREE:
        time[u], distance[u] = now, nearest + 1
        return n_orphans, tail, n_queued
    for a in range(6):
        v = u + steps[a]
        if tree[v] != own_tree:
            continue
        residual = capacity[_link(v, a ^ 1)] if own_tree == OF_OLD else capacity[_link(u, a)]
        if residual > 0 and not flow.is_queued[v]:
            queue[tail], flow.is_queued[v] = v, True
            tail = tail + 1 if tail + 1 < len(queue) else 0
            n_queued += 1
        if parent[v] < TREE_ROOT and v + steps[np.int64(parent[v])] == u:
            parent[v] = ORPHAN
            flow.orphans[n_orphans] = v
            n_orphans += 1
    tree[u] = FREE
    return n_orphans, tail, n_queued
