"""Cracks and fragments from the damage of points at rest. Plain Python."""
import collections

BROKEN = 0.5  # damage of a point that is part of a crack
SMALL = 0.005  # share of the points below which a piece is debris


def fragments(rest, damage, spacing):
    """Sizes of the connected parts of sound points, as shares of all points, largest first;
    neighbours are up to 1.6 spacings apart."""
    reach = 1.6 * spacing
    sound = [k for k, d in enumerate(damage) if d < BROKEN]
    grid = collections.defaultdict(list)
    for k in sound:
        grid[cell(rest[k], reach)].append(k)
    left, sizes = set(sound), []
    while left:
        stack = [left.pop()]
        size = 0
        while stack:
            k = stack.pop()
            size += 1
            i, j = cell(rest[k], reach)
            for a in (i - 1, i, i + 1):
                for b in (j - 1, j, j + 1):
                    for m in grid.get((a, b), ()):
                        if m in left and near(rest[k], rest[m], reach):
                            left.remove(m)
                            stack.append(m)
        sizes.append(size / len(damage))
    return sorted((s for s in sizes if s > SMALL), reverse=True)


def cell(place, width):
    return int(place[0] // width), int(place[1] // width)


def near(a, b, reach):
    return (a[0] - b[0])**2 + (a[1] - b[1])**2 < reach * reach


def broken_share(damage):
    """Share of the points that are cracks [%]."""
    return 100 * sum(d >= BROKEN for d in damage) / len(damage)
