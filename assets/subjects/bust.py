"""A bearded thinker on a socle: 4,555 vertices, 8,767 triangles, a marble texture with its shadows."""
import math

from kit import noise, solids
from kit.canvas import mix
from kit.png import Picture
from kit.solids import blend, capsule, carve, ellipsoid, sphere, step

# Metres, Z up, the face towards -Y. The head's middle is at z = 0.47.
SEGMENTS, RINGS, REACH, TEXTURE, COARSE = 85, 47, 0.45, 512, 256
FRONT = 0.58  # how much closer together the points of a ring are in front
AXIS = solids.Axis([(0.47, 90), (0.47, 55), (0.47, 20), (0.46, 4), (0.44, -6), (0.405, -8), (0.37, -5),
                    (0.342, 0), (0.315, 8), (0.285, 14), (0.257, 9), (0.235, -2), (0.215, -16), (0.195, -30),
                    (0.17, -26), (0.135, -6), (0.1, 0), (0.07, 0), (0.045, 0), (0.02, 0), (0.0, 0)])
MARBLE, WARM, SHADE = (234, 226, 212), (208, 186, 152), (128, 106, 88)


def curls(p, size, depth):
    """Locks of hair: short waves that turn about one another."""
    x, y, z = p[0] / size, p[1] / size, p[2] / size
    a = math.sin(x * 1.9 + 1.3 * math.sin(z * 1.1) + y) * math.sin(z * 1.7 + 1.2 * math.sin(x * 1.3 - y))
    b = math.sin(y * 2.1 + 1.2 * math.sin(z * 1.6 + x))
    return depth * (0.62 * abs(a) ** 0.5 + 0.38 * b * b)


def face(p, x):
    """The head without its hair; x is |p.x|."""
    d = ellipsoid(p, (0, 0.012, 0.492), (0.073, 0.094, 0.094))
    d = blend(d, ellipsoid(p, (0, -0.022, 0.428), (0.058, 0.066, 0.082)), 0.03)
    q = (x, p[1], p[2])
    d = blend(d, ellipsoid(q, (0.037, -0.066, 0.44), (0.021, 0.016, 0.017)), 0.02)
    d = blend(d, capsule(q, (0.012, -0.083, 0.485), (0.05, -0.062, 0.488), 0.0085, 0.0065), 0.014)
    d = carve(d, ellipsoid(q, (0.031, -0.088, 0.467), (0.019, 0.022, 0.0125)), 0.01)
    d = blend(d, sphere(q, (0.031, -0.061, 0.4655), 0.0145), 0.002)
    d = blend(d, capsule(q, (0.0175, -0.0735, 0.4745), (0.045, -0.0655, 0.4735), 0.0046, 0.004), 0.004)
    d = blend(d, capsule(q, (0.02, -0.073, 0.457), (0.042, -0.066, 0.4585), 0.0036, 0.0034), 0.005)
    d = blend(d, capsule(p, (0, -0.084, 0.479), (0, -0.108, 0.438), 0.008, 0.0105), 0.012)
    d = blend(d, sphere(q, (0.0115, -0.095, 0.4345), 0.0085), 0.006)
    d = blend(d, capsule(p, (-0.016, -0.088, 0.397), (0.016, -0.088, 0.397), 0.0068, 0.0068), 0.006)
    d = carve(d, capsule(q, (0, -0.1, 0.4035), (0.021, -0.09, 0.402), 0.0028, 0.002), 0.005)
    d = blend(d, ellipsoid(q, (0.076, 0.016, 0.462), (0.0095, 0.019, 0.03)), 0.007)
    return d


def hair(p, x):
    """The cap of hair, the moustache and the beard."""
    locks = curls(p, 0.0125, 0.014)
    cap = ellipsoid(p, (0, 0.024, 0.501), (0.081, 0.095, 0.096))
    brow = 0.541 - 0.35 * max(x - 0.02, 0.0) + 0.1 * max(p[1] + 0.02, 0.0)
    cap = carve(cap, solids.box(p, (0, -0.1, brow - 0.2), (0.3, 0.082, 0.2), 0.02), 0.016)
    cap = carve(cap, solids.box(p, (0, 0, 0.3), (0.3, 0.3, 0.105), 0.01), 0.02)
    beard = ellipsoid(p, (0, -0.054, 0.373), (0.055, 0.047, 0.055))
    beard = blend(beard, ellipsoid(p, (0, -0.066, 0.335), (0.036, 0.03, 0.045)), 0.03)
    q = (x, p[1], p[2])
    beard = blend(beard, capsule(q, (0.069, -0.008, 0.455), (0.055, -0.04, 0.392), 0.009, 0.02), 0.02)
    beard = carve(beard, ellipsoid(p, (0, -0.107, 0.4), (0.0215, 0.022, 0.0105)), 0.008)
    moustache = capsule(q, (0.004, -0.1015, 0.4125), (0.034, -0.082, 0.397), 0.0072, 0.0045)
    fine = curls((p[0], p[1], p[2] * 0.55), 0.0085, 0.0105)
    return blend(cap - locks + 0.004, blend(beard - fine + 0.003, moustache, 0.004), 0.006)


def body(p, x):
    """Neck, chest with its cloak, and the socle."""
    q = (x, p[1], p[2])
    neck = capsule(p, (0, 0.016, 0.44), (0, 0.026, 0.30), 0.053, 0.058)
    neck = blend(neck, capsule(q, (0.05, 0.03, 0.42), (0.014, -0.046, 0.292), 0.012, 0.01), 0.02)
    chest = ellipsoid(p, (0, 0.014, 0.225), (0.165, 0.092, 0.098))
    chest = blend(chest, ellipsoid(q, (0.122, 0.02, 0.25), (0.062, 0.064, 0.062)), 0.05)
    chest = blend(chest, capsule(q, (0.03, 0.032, 0.345), (0.135, 0.02, 0.275), 0.034, 0.042), 0.04)
    chest = blend(chest, capsule(q, (0.02, -0.052, 0.287), (0.13, -0.022, 0.3), 0.009, 0.012), 0.025)
    chest = blend(chest, ellipsoid(q, (0.06, -0.05, 0.222), (0.062, 0.036, 0.04)), 0.03)
    chest = blend(chest, neck, 0.045)
    # The cloak: thicker stuff over the left shoulder, in folds that run to the right hip.
    along = (p[0] * 0.78 - (p[2] - 0.2) * 0.62) / 0.0085
    edge = p[0] * 0.62 + (p[2] - 0.235) * -0.55 + 0.5 * p[1] * step(0.0, 0.1, p[1])
    folds = 0.006 * math.sin(along + 1.1 * math.sin(p[2] * 28 + p[0] * 9)) + 0.012
    chest -= folds * step(-0.004, 0.012, edge) * step(0.335, 0.29, p[2])
    chest = carve(chest, solids.box(p, (0, 0, 0.0), (0.4, 0.4, 0.132 + 0.9 * x * x), 0.01), 0.012)
    chest = carve(chest, 0.178 - 0.12 * (p[2] - 0.15) - x, 0.02)
    r = math.sqrt(p[0] ** 2 + p[1] ** 2)
    waist = 0.045 + 0.55 * abs(p[2] - 0.1) ** 1.5
    socle = max(r - waist, abs(p[2] - 0.1) - 0.06)
    for z, wide, tall in ((0.132, 0.05, 0.0075), (0.062, 0.064, 0.0085), (0.046, 0.074, 0.006)):
        socle = blend(socle, math.hypot(max(r - wide, 0.0), p[2] - z) - tall, 0.004)
    socle = blend(socle, max(r - 0.09, p[2] - 0.038), 0.003)
    return blend(chest, socle * 0.8, 0.01)


def solid(p):
    """The distance from p to the bust."""
    x = abs(p[0])
    d = body(p, x) if p[2] < 0.47 else 1.0
    if p[2] > 0.24:
        d = blend(d, blend(face(p, x), hair(p, x), 0.006), 0.02)
    return d


def turns():
    """The directions of a ring's points: closer together over the face than over the back."""
    out = []
    for j in range(SEGMENTS):
        a = 2 * math.pi * (j / SEGMENTS - 0.5)
        out.append(-math.pi / 2 + a - FRONT * math.sin(a))
    return out


def layout():
    """The heights of the rings."""
    sides = [-math.pi / 2, -1.1, -0.4, 0.4, math.pi / 2]
    return solids.spread(solid, AXIS, RINGS + 2, REACH, sides, lambda t: 2.1 if 0.09 < t < 0.42 else 0.8)


def build():
    """The mesh. Its texture runs around in u, from the seam at the back, and down in v."""
    heights = layout()
    mesh, rings = solids.wrap(solid, AXIS, heights, turns(), REACH, 2)
    for i in rings[-1]:
        mesh.points[i] = (*mesh.points[i][:2], 0.0)
    rows = []
    for k, ring in enumerate(rings):
        v = 0.995 - 0.99 * (k + 1) / len(rings)
        rows.append(range(len(mesh.uvs), len(mesh.uvs) + len(ring) + 1))
        mesh.uvs += [(j / len(ring), v) for j in range(len(ring) + 1)]
    pole_row = range(len(mesh.uvs), len(mesh.uvs) + SEGMENTS)
    mesh.uvs += [((j + 0.5) / SEGMENTS, 0.995) for j in range(SEGMENTS)]
    solids.stitch(mesh, rings, rows, pole_row)
    mesh.split(48, False)
    mesh.split(1, True)
    return mesh


def shade_at(u, v, heights):
    """The light and the height that the texture takes at (u, v): of the solid, not of the mesh."""
    k = min(max((0.995 - v) / 0.99 * len(heights), 0.0), len(heights) - 1e-6)
    i = int(k)
    low = 0.0 if i == 0 else heights[i - 1]
    t = low + (heights[i] - low) * (k - i)
    a = 2 * math.pi * (u - 0.5)
    p = solids.hit(solid, *solids.ray(AXIS, t, -math.pi / 2 + a - FRONT * math.sin(a)), REACH, 4e-4)
    n = solids.slope(solid, p, 0.0015)
    light = 0.5 + 0.5 * solids.openness(solid, p, n, 0.006)
    return light * (0.93 + 0.07 * n[2]), p


def texture():
    """Marble, darker in the hollows: seen from far, the picture gives the mesh its fine form."""
    heights, coarse = layout(), []
    for j in range(COARSE):
        coarse.append([shade_at((i + 0.5) / COARSE, 1 - (j + 0.5) / COARSE, heights)
                       for i in range(COARSE)])
    out, at = Picture(TEXTURE, TEXTURE), 0
    for y in range(TEXTURE):
        fy = (y + 0.5) * COARSE / TEXTURE - 0.5
        j = min(max(int(fy), 0), COARSE - 2)
        for x in range(TEXTURE):
            fx = (x + 0.5) * COARSE / TEXTURE - 0.5
            i = min(max(int(fx), 0), COARSE - 2)
            light, p = lerp(coarse, i, j, fx - i, fy - j)
            vein = abs(noise.solid(p[0] * 14, p[1] * 14, p[2] * 14 + 3, 71)
                       + 0.4 * noise.solid(p[0] * 45, p[1] * 45, p[2] * 45, 75) - 0.7)
            colour = mix(MARBLE, WARM, 0.9 * noise.solid(p[0] * 22, p[1] * 22, p[2] * 22, 81) ** 2)
            colour = mix(colour, (150, 148, 152), 0.42 * max(1 - vein * 26, 0.0))
            colour = mix(SHADE, colour, min(max(light * 1.25 - 0.2, 0.0), 1.0))
            grain = 0.97 + 0.06 * noise.lattice(x, y, 90)
            for c in range(3):
                out.pixels[at + c] = min(int(colour[c] * (0.55 + 0.45 * light) * grain + 0.5), 255)
            at += 3
    return out


def lerp(grid, i, j, fx, fy):
    """Light and place between four neighbours of the coarse grid."""
    (l0, p0), (l1, p1) = grid[j][i], grid[j][i + 1]
    (l2, p2), (l3, p3) = grid[j + 1][i], grid[j + 1][i + 1]
    top, low = l0 + (l1 - l0) * fx, l2 + (l3 - l2) * fx
    p = tuple((a + (b - a) * fx) * (1 - fy) + (c + (d - c) * fx) * fy
              for a, b, c, d in zip(p0, p1, p2, p3))
    return top + (low - top) * fy, p
