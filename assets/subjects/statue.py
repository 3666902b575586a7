"""A robed figure with a dove: 21,453 vertices, 42,712 triangles, painted by vertex colours."""
import math

from kit import noise, solids
from kit.canvas import mix
from kit.solids import blend, capsule, carve, ellipsoid, sphere, step

# Metres (millimetres in the file), Z up, the face towards -Y, the plinth's foot at z = 0.
SEGMENTS, RINGS, REACH, FRONT = 96, 221, 0.6, 0.3
AXIS = solids.Axis([(1.66, 90), (1.66, 55), (1.66, 22), (1.65, 2), (1.62, -4), (1.57, -8), (1.53, -4), (1.5, 4),
                    (1.465, 11), (1.43, 11), (1.39, 3), (1.33, 0), (1.24, 0), (1.15, 0), (1.05, 0), (0.95, 0),
                    (0.8, 0), (0.65, 0), (0.5, 0), (0.36, 0), (0.25, -12), (0.19, -20), (0.12, -10), (0.05, 0),
                    (0.0, 0)])
STONE, SKIN, HAIR, LIPS = (214, 204, 184), (226, 184, 150), (124, 66, 40), (176, 84, 72)
ROBE, CLOAK, HEM, GOLD, DOVE = (78, 128, 148), (172, 70, 52), (240, 222, 176), (212, 166, 72), (240, 236, 226)


def head(p, q):
    d = ellipsoid(p, (0, 0.012, 1.672), (0.07, 0.088, 0.088))
    d = blend(d, ellipsoid(p, (0, -0.024, 1.615), (0.05, 0.058, 0.072)), 0.03)
    d = blend(d, ellipsoid(q, (0.033, -0.06, 1.622), (0.02, 0.016, 0.018)), 0.02)
    d = blend(d, capsule(q, (0.012, -0.077, 1.664), (0.046, -0.06, 1.667), 0.006, 0.005), 0.014)
    d = carve(d, ellipsoid(q, (0.03, -0.084, 1.648), (0.018, 0.02, 0.011)), 0.01)
    d = blend(d, sphere(q, (0.03, -0.059, 1.647), 0.0145), 0.002)
    d = blend(d, capsule(q, (0.016, -0.073, 1.656), (0.043, -0.064, 1.655), 0.004, 0.0034), 0.004)
    d = blend(d, capsule(p, (0, -0.078, 1.66), (0, -0.098, 1.622), 0.0065, 0.0085), 0.011)
    d = blend(d, sphere(q, (0.009, -0.087, 1.619), 0.007), 0.005)
    d = blend(d, capsule(q, (0.0, -0.083, 1.597), (0.017, -0.076, 1.5965), 0.0052, 0.0032), 0.003)
    d = blend(d, capsule(q, (0.0, -0.081, 1.586), (0.014, -0.075, 1.5865), 0.006, 0.004), 0.003)
    d = blend(d, sphere(p, (0, -0.068, 1.56), 0.014), 0.02)
    neck = capsule(p, (0, 0.014, 1.62), (0, 0.026, 1.45), 0.047, 0.054)
    return blend(d, neck, 0.02)


def hair(p, q):
    wave = 0.0042 * math.sin(q[0] * 190 + 2.2 * math.sin(p[2] * 46) + p[1] * 60)
    cap = ellipsoid(p, (0, 0.028, 1.686), (0.083, 0.09, 0.094))
    brow = ellipsoid(p, (0, -0.1, 1.632), (0.058, 0.075, 0.088))
    cap = carve(cap, brow, 0.012)
    cap = carve(cap, solids.box(p, (0, 0, 1.4), (0.3, 0.3, 0.215), 0.01), 0.02)
    cap = blend(cap, ellipsoid(p, (0, 0.118, 1.67), (0.042, 0.036, 0.04)), 0.012)
    braid = capsule(q, (0.074, 0.0, 1.63), (0.092, -0.05, 1.47), 0.017, 0.017)
    braid = min(braid, capsule(q, (0.092, -0.05, 1.47), (0.088, -0.128, 1.33), 0.016, 0.012))
    return blend(cap + wave, braid + 0.0035 * math.cos(p[2] * 240 + q[0] * 90), 0.01)


def diadem(p):
    y, z = p[1] - 0.02, p[2] - 1.715 - 0.28 * (p[1] - 0.02) * -1.0
    r = math.sqrt((p[0] / 0.083) ** 2 + (y / 0.09) ** 2)
    return math.hypot((r - 0.99) * 0.085, max(abs(z) - 0.008, 0.0)) - 0.006


def robe(p, q):
    """The long dress, its pleats deepening downwards, a belt and a fold of cloth over it."""
    turn = math.atan2(p[1], p[0])
    low = step(1.0, 0.35, p[2])
    d = ellipsoid(p, (0, 0.018, 1.33), (0.165, 0.098, 0.17))
    d = blend(d, ellipsoid(q, (0.068, -0.072, 1.315), (0.062, 0.055, 0.064)), 0.03)
    d = blend(d, capsule(q, (0.05, 0.02, 1.445), (0.15, 0.016, 1.405), 0.052, 0.062), 0.04)
    d = blend(d, ellipsoid(p, (0, 0.012, 0.95), (0.172, 0.125, 0.24)), 0.09)
    wide = 0.158 + 0.05 * step(0.9, 0.14, p[2])
    r = math.sqrt(p[0] ** 2 + (p[1] * 1.14) ** 2)
    skirt = max((r - wide) * 0.86, p[2] - 0.98, 0.13 - p[2])
    skirt = carve(skirt, capsule(q, (0.0, -0.27, 0.2), (0.0, -0.23, 0.7), 0.075, 0.03), 0.08)
    knee = capsule(p, (0.075, -0.095, 0.72), (0.08, -0.1, 0.22), 0.066, 0.046)
    d = blend(d, blend(skirt, knee, 0.05), 0.06)
    pleats = abs(math.sin(turn * 10.5 + 0.7 * math.sin(p[2] * 5 + p[0] * 4) + 0.3)) ** 0.7 - 0.62
    calm = 1 - 0.75 * math.exp(-((p[0] - 0.08) ** 2 + (p[1] + 0.15) ** 2 + (p[2] - 0.62) ** 2 * 0.25) / 0.012)
    d -= (0.004 + 0.0165 * low) * pleats * step(1.4, 1.15, p[2]) * calm
    hem = 0.985 + 0.022 * math.sin(turn * 7 + 0.5) - 0.1 * p[0]
    fold = step(hem - 0.012, hem + 0.012, p[2]) * step(1.16, 1.09, p[2])
    d -= 0.016 * fold + 0.007 * fold * math.sin(turn * 16 + 3 * math.sin(p[2] * 9))
    return d + 0.016 * math.exp(-((p[2] - 1.118) / 0.014) ** 2)


def cloak(p, dress):
    """A strip of heavier cloth from the left shoulder to the right hip and down the back."""
    edge = abs((p[2] - 1.26) - 0.95 * p[0] + (0.22 * p[1] if p[1] > 0 else 0.0)) * 0.72
    fall = 0.0052 * math.sin(((p[2] - 1.26) * 0.72 - 0.69 * p[0]) * 150 + 2 * math.sin(p[0] * 14))
    tail = capsule(p, (0.165, 0.03, 1.42), (0.225, 0.062, 0.78), 0.036, 0.05)
    tail += 0.006 * math.sin(p[0] * 170 + p[1] * 120)
    tail = max(tail, 0.72 + 0.03 * math.sin(p[0] * 60 + p[1] * 40) - p[2])
    strip = max(dress - 0.015 - fall, edge - 0.062, 0.98 - p[2], p[2] - 1.47)
    return blend(strip, tail, 0.02)


def arms(p):
    right = capsule(p, (-0.17, 0.012, 1.4), (-0.2, 0.012, 1.13), 0.055, 0.046)
    right = blend(right, capsule(p, (-0.2, 0.012, 1.13), (-0.182, -0.07, 0.9), 0.045, 0.033), 0.02)
    right = blend(right, ellipsoid(p, (-0.176, -0.088, 0.845), (0.03, 0.036, 0.056)), 0.02)
    left = capsule(p, (0.17, 0.012, 1.4), (0.206, -0.004, 1.14), 0.055, 0.046)
    left = blend(left, capsule(p, (0.206, -0.004, 1.14), (0.085, -0.15, 1.185), 0.046, 0.033), 0.02)
    left = blend(left, ellipsoid(p, (0.045, -0.168, 1.197), (0.05, 0.03, 0.03)), 0.02)
    for k in range(4):
        left = blend(left, capsule(p, (0.04, -0.19, 1.178 + 0.013 * k),
                                   (-0.012 + 0.004 * k, -0.186, 1.184 + 0.013 * k), 0.0085, 0.007), 0.004)
    return min(right, left)


def dove(p):
    d = ellipsoid(p, (0.012, -0.16, 1.262), (0.07, 0.043, 0.044))
    d = blend(d, sphere(p, (-0.05, -0.178, 1.311), 0.026), 0.03)
    d = blend(d, capsule(p, (-0.07, -0.188, 1.31), (-0.084, -0.193, 1.304), 0.008, 0.004), 0.006)
    d = blend(d, capsule(p, (0.07, -0.152, 1.262), (0.135, -0.115, 1.262), 0.026, 0.017), 0.02)
    wing = ellipsoid(p, (0.038, -0.182, 1.272), (0.06, 0.026, 0.026)) + 0.0022 * math.sin(p[0] * 330 + p[2] * 190)
    return blend(d, wing, 0.004)


def parts(p):
    """The distance to each part, in the order of `paint`; far parts answer a rough bound."""
    q = (abs(p[0]), p[1], p[2])
    far = 0.2
    dress = robe(p, q) if p[2] < 1.62 else far
    skin = head(p, q) if p[2] > 1.38 else far
    if 0.7 < p[2] < 1.55:
        skin = blend(skin, arms(p), 0.02)
    feet = far
    if p[2] < 0.4:
        feet = ellipsoid(q, (0.072, -0.168, 0.135), (0.043, 0.088, 0.034))
        for k in range(4):
            feet = blend(feet, sphere(q, (0.045 + 0.018 * k, -0.248 + 0.008 * k, 0.134), 0.013), 0.006)
    r = math.hypot(p[0], p[1])
    plinth = far
    if p[2] < 0.4:
        plinth = max(r - 0.272, abs(p[2] - 0.05) - 0.05)
        plinth = carve(plinth, math.hypot(r - 0.28, p[2] - 0.062) - 0.017, 0.006)
        plinth = blend(plinth, math.hypot(max(r - 0.262, 0.0), p[2] - 0.096) - 0.015, 0.004)
    return (min(skin, feet), hair(p, q) if p[2] > 1.2 else far, dress,
            cloak(p, dress) if 0.6 < p[2] < 1.6 else far,
            diadem(p) if p[2] > 1.6 else far, dove(p) if 1.1 < p[2] < 1.45 else far, plinth)


def solid(p):
    """The distance from p to the figure."""
    skin, locks, dress, wrap, crown, bird, plinth = parts(p)
    d = blend(blend(skin, locks, 0.006), blend(dress, wrap, 0.004), 0.012)
    return min(blend(d, bird, 0.006), crown, blend(d, plinth, 0.012)) * 0.9


def pattern(p, turn):
    """The robe's cloth: bands near the hem, a sprinkle of small rings above."""
    z = p[2]
    if 0.165 < z < 0.185 or 0.255 < z < 0.27:
        return HEM
    if 0.185 <= z <= 0.255:
        k = int((turn + math.pi) * 5.2) % 2
        return GOLD if (k == 0) == (z > 0.22) else CLOAK
    if 1.098 < z < 1.136:
        return GOLD
    u, v = (turn + math.pi) * 3.1831, z * 15.0
    u += 0.5 * (int(v) % 2)
    inside = step(0.4, 0.24, math.hypot(u % 1 - 0.5, v % 1 - 0.5)) if z < 0.97 else 0.0
    return mix(ROBE, HEM, inside)


def paint(p):
    """The colour at p: remains of old paint on stone, darker in the hollows."""
    distances = parts(p)
    part = min(range(len(distances)), key=lambda i: (round(distances[i], 7), i))
    turn = math.atan2(p[1], p[0])
    x = abs(p[0])
    colour = (SKIN, HAIR, ROBE, CLOAK, GOLD, DOVE, STONE)[part]
    if part == 2:
        colour = pattern(p, turn)
    if part == 3 and (abs((p[2] - 1.26) - 0.95 * p[0]) * 0.72 > 0.044 and p[1] < 0.03 and p[0] < 0.17):
        colour = GOLD
    if part == 0 and p[1] < -0.05 and p[2] > 1.5:
        if math.hypot(x / 0.02, (p[2] - 1.5915) / 0.01) < 1:
            colour = LIPS
        elif math.hypot((x - 0.03) / 0.007, (p[2] - 1.647) / 0.006) < 1:
            colour = (58, 44, 38)
        elif abs(p[2] - 1.669 + (x - 0.03) ** 2 * 9) < 0.0045 and 0.01 < x < 0.05:
            colour = HAIR
    if part == 0 and 1.12 < p[2] < 1.47 and x > 0.13:  # sleeves, with a seam
        colour = GOLD if p[2] < 1.15 or abs(p[2] - 0.2 * x - 1.24) < 0.008 else ROBE
    if part == 5 and p[0] < -0.066:
        colour = GOLD
    n = solids.slope(solid, p, 0.004)
    light = 0.46 + 0.54 * solids.openness(solid, p, n, 0.014)
    worn = noise.solid(p[0] * 9 + 2, p[1] * 9, p[2] * 9, 91) * 0.6
    worn += noise.solid(p[0] * 34, p[1] * 34, p[2] * 34, 94) * 0.4
    bare = step(0.59, 0.7, worn + 0.06 * step(0.5, 0.12, p[2]) + 0.08 * (n[2] > 0.6))
    stone = mix(STONE, (176, 160, 132), noise.solid(p[0] * 20, p[1] * 20, p[2] * 20, 97))
    if part != 6:
        stone = mix(colour, stone, 0.2 + 0.66 * bare)
    if worn < 0.36 and (part == 6 or p[2] < 0.5):
        stone = mix(stone, (132, 138, 96), 0.55 * step(0.36, 0.3, worn))
    grain = 0.95 + 0.1 * noise.solid(p[0] * 150, p[1] * 150, p[2] * 150, 99)
    return tuple(min(c / 255 * light * grain, 1.0) for c in stone)


def build():
    """The mesh, in millimetres."""
    turns = []
    for j in range(SEGMENTS):
        a = 2 * math.pi * (j / SEGMENTS - 0.5)
        turns.append(-math.pi / 2 + a - FRONT * math.sin(a))
    sides = [-math.pi / 2, -1.2, -0.4, 0.5, math.pi / 2]
    heights = solids.spread(solid, AXIS, RINGS + 1, REACH, sides,
                            lambda t: 2.6 if t < 0.27 else 1.3 if t < 0.52 else 0.9)
    mesh, rings = solids.wrap(solid, AXIS, heights, turns, REACH, 1)
    solids.stitch(mesh, rings)
    for i in rings[-1]:
        mesh.points[i] = (*mesh.points[i][:2], 0.0)
    mesh.colours = [paint(p) for p in mesh.points]
    mesh.points = [(1000 * x, 1000 * y, 1000 * z) for x, y, z in mesh.points]
    mesh.split(44, False)
    return mesh
