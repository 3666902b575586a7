"""Value noise on an integer lattice: equal on every machine, with no state."""
import functools


@functools.lru_cache(1 << 16)  # neighbouring pixels ask for the same points
def lattice(x, y, seed=0):
    """A value in [0, 1] for the lattice point (x, y)."""
    h = (x * 374761393 + y * 668265263 + seed * 2246822519) & 0xFFFFFFFF
    h = ((h ^ (h >> 13)) * 1274126177) & 0xFFFFFFFF
    h = ((h ^ (h >> 15)) * 2654435761) & 0xFFFFFFFF
    return ((h ^ (h >> 16)) & 0xFFFF) / 65535.0


def value(x, y, seed=0, wrap=0):
    """Smooth noise in [0, 1]; with `wrap`, x repeats after that many cells."""
    ix, iy = int(x // 1), int(y // 1)
    fx, fy = x - ix, y - iy
    fx, fy = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy)
    jx = ix + 1
    if wrap:
        ix, jx = ix % wrap, jx % wrap
    a, b = lattice(ix, iy, seed), lattice(jx, iy, seed)
    c, d = lattice(ix, iy + 1, seed), lattice(jx, iy + 1, seed)
    top = a + (b - a) * fx
    return top + (c + (d - c) * fx - top) * fy


def fbm(x, y, seed=0, octaves=4, wrap=0):
    """Octaves of `value`, each of half the size and weight; in [0, 1]."""
    total, weight, reach = 0.0, 0.5, 0.0
    for k in range(octaves):
        total += weight * value(x, y, seed + k, wrap)
        reach += weight
        x, y, weight, wrap = x * 2, y * 2, weight * 0.5, wrap * 2
    return total / reach


def solid(x, y, z, seed=0):
    """Noise in [0, 1] over space, from three planes."""
    return (value(x, y, seed) + value(y + 17.3, z, seed + 1) + value(z + 5.1, x, seed + 2)) / 3.0
