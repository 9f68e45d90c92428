"""The exact minimum cut of a volume's patch: the largest flow from old cells to new ones.

The cut pays, for each pair of neighbours of which one stays old and one is taken new, the cells of
the two that differ between old and new. The cheapest cut is a largest flow (Ford and Fulkerson
1956), here by Dinic's algorithm over the cells that differ and their neighbours alone: all others
cost nothing on either side. Data are capacities that no cheapest cut goes through, as long as they
do not contradict each other.
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
UNSEEN, INACTIVE = -1, -2
FAR = 1 << 30


class FlowWorkspace(NamedTuple):
    """Arrays for the cut of one box, with a margin of one cell on each side."""

    state: NDArray[np.uint8]
    capacity: NDArray[np.int32]  # shape (6, n): to the neighbour in each direction
    # capacity left from the old cells, and to the new ones
    source: NDArray[np.int32]
    sink: NDArray[np.int32]
    level: NDArray[np.int32]  # links to the new cells
    arc: NDArray[np.uint8]  # the direction that is tried next
    # cells that take part, a queue and a stack of cells
    cells: NDArray[np.int32]
    queue: NDArray[np.int32]
    stack: NDArray[np.int32]


def make_flow(template: Triple) -> FlowWorkspace:
    """Return the workspace for boxes of at most `template` cells; empty for none."""
    nz, ny, nx = template
    n = (nz + 2) * (ny + 2) * (nx + 2) if nz else 0
    source, sink, level, cells, queue, stack = (np.zeros(n, np.int32) for _ in range(6))
    state, arc, capacity = np.zeros(n, np.uint8), np.zeros(n, np.uint8), np.zeros((6, n), np.int32)
    return FlowWorkspace(state, capacity, source, sink, level, arc, cells, queue, stack)


@part_of_kernel
def minimum_cut(grid, data, image, place, box, flow, keep_mask):
    """Mark in `keep_mask`, all False on entry, the cells of a box where the grid stays.

    Returns the cost of the cut.
    """
    row = box.nx + 2
    layer = row * (box.ny + 2)
    steps = (-1, 1, -row, row, -layer, layer)
    _mark_states(grid, image, place, box, flow)
    n, total = _make_graph(grid, data, image, place, box, steps, flow)
    while True:
        n_reached, nearest = _set_levels(n, steps, flow)
        if nearest == FAR:
            break
        total += _push(n_reached, nearest, steps, flow)
    _mark_old(n, box, steps, flow, keep_mask)
    return total


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
                before = grid[box.z0 + z, box.y0 + y, box.x0 : box.x0 + box.nx]
                after = image[tz + z, ty + y, tx : tx + box.nx]
                own = flow.state[u + 1 : u + 1 + box.nx]
                for x in range(box.nx):
                    own[x] = before[x] != after[x]
                if low_z <= z < high_z and low_y <= y < high_y:
                    for x in range(low_x, high_x):
                        own[x] = ALL_NEW
            for x in range(box.nx + 2):
                flow.level[u + x] = INACTIVE
            u += box.nx + 2


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
                if own == SAME:
                    beside = False
                    for a in range(6):
                        beside = beside or state[u + steps[a]] == DIFFERS
                    if not beside:
                        continue
                source, sink = np.int32(0), np.int32(0)
                for a in range(6):
                    other = np.int32(state[u + steps[a]])
                    free = other <= DIFFERS
                    flow.capacity[a, u] = own + other if free else 0
                    sink += own if other == ALL_NEW else 0
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
                flow.source[u], flow.sink[u] = source - through, sink - through
                flow.level[u] = UNSEEN
                flow.cells[n] = u
                n += 1
    return n, total


@part_of_kernel
def _set_levels(n, steps, flow):
    """Set how many links each cell is from the new cells, along which flow can go there.

    Returns how many cells were reached, in the order of `queue`, and how far the nearest one with
    flow to give is; FAR where there is none.
    """
    level, queue = flow.level, flow.queue
    tail, nearest = 0, FAR
    for k in range(n):
        u = flow.cells[k]
        level[u] = UNSEEN
        if flow.sink[u] > 0:
            level[u] = 0
            queue[tail] = u
            tail += 1
    head = 0
    while head < tail:
        u = queue[head]
        head += 1
        if level[u] >= nearest:
            break
        if flow.source[u] > 0:
            nearest = min(nearest, level[u])
            continue
        for a in range(6):
            v = u + steps[a]
            if level[v] == UNSEEN and flow.capacity[a ^ 1, v] > 0:
                level[v] = level[u] + 1
                queue[tail] = v
                tail += 1
    return tail, nearest


@part_of_kernel
def _push(n_reached, nearest, steps, flow):
    """Send all flow that goes along descending levels; return how much."""
    level, arc, stack, total = flow.level, flow.arc, flow.stack, np.int64(0)
    for k in range(n_reached):
        arc[flow.queue[k]] = 0
    for k in range(n_reached - 1, -1, -1):
        root = flow.queue[k]
        if level[root] > nearest:
            continue
        while flow.source[root] > 0:
            depth = 0
            stack[0] = root
            found = False
            while depth >= 0:
                u = stack[depth]
                if level[u] == 0 and flow.sink[u] > 0:
                    found = True
                    break
                moved = False
                while arc[u] < 6:
                    a = arc[u]
                    if flow.capacity[a, u] > 0:
                        v = u + steps[a]
                        if level[v] >= 0 and level[v] == level[u] - 1:
                            depth += 1
                            stack[depth] = v
                            moved = True
                            break
                    arc[u] += 1
                if not moved:
                    depth -= 1
                    if depth >= 0:
                        arc[stack[depth]] += 1
            if not found:
                break
            amount = min(flow.source[root], flow.sink[stack[depth]])
            for i in range(depth):
                amount = min(amount, flow.capacity[arc[stack[i]], stack[i]])
            flow.source[root] -= amount
            flow.sink[stack[depth]] -= amount
            total += amount
            for i in range(depth):
                u, a = stack[i], arc[stack[i]]
                flow.capacity[a, u] -= amount
                flow.capacity[a ^ 1, stack[i + 1]] += amount
    return total


@part_of_kernel
def _mark_old(n, box, steps, flow, keep_mask):
    """Mark the cells that flow from the old ones can still reach: they stay."""
    level, queue, tail = flow.level, flow.queue, 0
    for k in range(n):
        u = flow.cells[k]
        level[u] = UNSEEN
        if flow.source[u] > 0:
            level[u] = 0
            queue[tail] = u
            tail += 1
    head = 0
    while head < tail:
        u = queue[head]
        head += 1
        row, x = divmod(u, box.nx + 2)
        z, y = divmod(row, box.ny + 2)
        keep_mask[z - 1, y - 1, x - 1] = True
        for a in range(6):
            v = u + steps[a]
            if level[v] == UNSEEN and flow.capacity[a, u] > 0:
                level[v] = 0
                queue[tail] = v
                tail += 1
