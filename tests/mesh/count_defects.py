#!/usr/bin/env python3
"""Counts the defects of an OBJ or ASCII PLY file by brute force, without any code of the bake: count_defects.py FILE.

By the file's indices. Islands and holes are counted by the limits that bake/README.md states.
"""
import collections
import json
import math
import sys


def read(path):
    """Positions and triangles (polygons as fans)."""
    lines = [line.split() for line in open(path, encoding="utf-8", errors="replace")]
    if lines[0] != ["ply"]:
        positions = [tuple(map(float, words[1:4])) for words in lines if words[:1] == ["v"]]
        faces = [[int(word.split("/")[0]) - 1 for word in words[1:]] for words in lines if words[:1] == ["f"]]
    else:
        count = {words[1]: int(words[2]) for words in lines if words[:1] == ["element"]}
        rows = lines[lines.index(["end_header"]) + 1:]
        positions = [tuple(map(float, words[:3])) for words in rows[:count["vertex"]]]
        faces = [list(map(int, words[1:1 + int(words[0])])) for words in rows[count["vertex"]:count["vertex"] + count["face"]]]
    return positions, [(f[0], f[i], f[i + 1]) for f in faces for i in range(1, len(f) - 1)]


class Sets:
    """Union-find."""

    def __init__(self):
        self.parent = {}

    def root(self, a):
        self.parent.setdefault(a, a)
        while self.parent[a] != a:
            self.parent[a] = self.parent[self.parent[a]]
            a = self.parent[a]
        return a

    def join(self, a, b):
        self.parent[self.root(a)] = self.root(b)


def diagonal(points):
    return math.dist(*([side(p[i] for p in points) for i in range(3)] for side in (min, max)))


def area(a, b, c):
    u, v = ([q[i] - a[i] for i in range(3)] for q in (b, c))
    return math.hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]) / 2


def groups(sets, items, key):
    found = collections.defaultdict(list)
    for item in items:
        found[sets.root(key(item))].append(item)
    return found


def count(positions, triangles):
    defects = collections.Counter()
    edges = collections.defaultdict(list)  # whether the triangle walks it up
    fans = collections.defaultdict(Sets)
    parts = Sets()
    for t in triangles:
        defects["degenerate"] += len(set(t)) < 3 or area(*(positions[v] for v in t)) == 0
        for i in range(3):
            a, b, c = t[i], t[(i + 1) % 3], t[(i + 2) % 3]
            edges[min(a, b), max(a, b)].append(a < b)
            fans[a].join(b, c)
            parts.join(a, b)
    repeats = collections.Counter(tuple(sorted(t)) for t in triangles)
    defects["duplicates"] = sum(n - 1 for n in repeats.values())
    defects["non_manifold_edges"] = sum(len(faces) > 2 for faces in edges.values())
    defects["winding"] = sum(len(faces) == 2 and faces[0] == faces[1] for faces in edges.values())
    defects["touching_vertices"] = sum(len({fan.root(n) for n in list(fan.parent)}) > 1 for fan in fans.values())
    boxes = {root: diagonal([positions[v] for t in of for v in t]) for root, of in groups(parts, triangles, lambda t: t[0]).items()}
    areas = {root: sum(area(*(positions[v] for v in t)) for t in of) for root, of in groups(parts, triangles, lambda t: t[0]).items()}
    whole = diagonal([positions[v] for t in triangles for v in t])
    islands = {r for r in boxes if boxes[r] < 0.02 * whole and areas[r] < 0.001 * sum(areas.values())}
    if sum(areas[r] for r in islands) > 0.01 * sum(areas.values()):
        islands = set()
    defects["islands"] = len(islands)
    loops = Sets()
    opened = [edge for edge, faces in edges.items() if len(faces) == 1]
    for a, b in opened:
        loops.join(a, b)
    for of in groups(loops, opened, lambda edge: edge[0]).values():
        root = parts.root(of[0][0])
        small = diagonal([positions[v] for edge in of for v in edge]) <= 0.01 * boxes[root]
        defects["holes"] += small and root not in islands
    return {**defects, "components": len(boxes), "open_edges": len(opened)}


if __name__ == "__main__":
    print(json.dumps(count(*read(sys.argv[1])), indent=1))
