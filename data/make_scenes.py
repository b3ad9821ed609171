#!/usr/bin/env python3
"""Makes the meshes and scenes in this folder.

    make_scenes.py           writes meshes/*.obj, scenes/*.json and the tables in README.md
    make_scenes.py --check   writes nothing; exit code 1 if a file differs from what would be written

The scene format is the one that `halfshade render` reads: y is up, lengths are metres. Each scene shows one thing that a
soft shadow method finds easy or hard, most of them after a figure of

    Chan and Durand, "Rendering Fake Soft Shadows with Smoothies", Eurographics Symposium on Rendering 2003
    Cai et al., "Shadow Mapping Using Multi-Layered Shadow Fins", 2006

The words beside each scene in SCENES say what it must show; change the numbers only so that the words stay true.
"""

import collections
import json
import math
import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))

# From the Debian package glmark2-data; the count is written here because the package need not be installed to make the scenes.
BUNNY_PATH = "/usr/share/glmark2/models/bunny.obj"
BUNNY_TRIANGLES = 69666


# ---- meshes -----------------------------------------------------------------------------------------------------------------
# A mesh is (vertices, triangles): triangles are counter-clockwise seen from outside. Solids are centred on the origin.


def number(x):
    """Six decimals: short files, and rounding hides the last bit in which maths libraries differ. Never "-0"."""
    return "%.6g" % (round(x, 6) + 0.0)


def volume(vertices, triangles):
    total = 0
    for a, b, c in ([vertices[i] for i in t] for t in triangles):
        total += (a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
                  + a[2] * (b[0] * c[1] - b[1] * c[0]))
    return total / 6


def ground():
    """The only open mesh: one quad facing up, two units wide, so that `scale` is its half-width."""
    return [(-1, 0, -1), (-1, 0, 1), (1, 0, 1), (1, 0, -1)], [(0, 1, 2), (0, 2, 3)]


def box():
    vertices = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return vertices, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]


def lathe(profile, segments, closed=False):
    """Turns a profile of (radius, y) about the y axis. The profile runs upwards on its outside; a point of radius 0 is a pole."""
    vertices, rings = [], []
    for radius, y in profile:
        count = segments if radius > 0 else 1
        rings.append([len(vertices) + i % count for i in range(segments)])
        for i in range(count):
            angle = 2 * math.pi * i / segments
            vertices.append((radius * math.cos(angle), y, radius * math.sin(angle)))
    pairs = list(zip(rings, rings[1:] + rings[:1])) if closed else list(zip(rings, rings[1:]))
    triangles = []
    for low, high in pairs:
        for i in range(segments):
            j = (i + 1) % segments
            triangles += [(low[i], high[i], high[j]), (low[i], high[j], low[j])]
    return vertices, [t for t in triangles if len(set(t)) == 3]  # a quad at a pole is one triangle


def cylinder():
    return lathe([(0, -0.5), (0.5, -0.5), (0.5, 0.5), (0, 0.5)], 64)


def cone():
    return lathe([(0, -0.5), (0.5, -0.5), (0, 0.5)], 64)


def arc(centre, radius, start_deg, stop_deg, steps):
    angles = [math.radians(start_deg + (stop_deg - start_deg) * i / steps) for i in range(steps + 1)]
    return [(centre + radius * math.cos(a), radius * math.sin(a)) for a in angles]


def sphere():
    return lathe([(0, -0.5)] + arc(0, 0.5, -90, 90, 24)[1:-1] + [(0, 0.5)], 48)


def torus():
    return lathe(arc(0.75, 0.25, 0, 360, 28)[:-1], 56, closed=True)


def icosahedron():
    g = (1 + math.sqrt(5)) / 2
    s = 0.5 / math.sqrt(1 + g * g)  # circumscribed sphere of radius 0.5
    signs = [(a, b) for a in (-s, s) for b in (-s * g, s * g)]
    vertices = [(0, a, b) for a, b in signs] + [(a, b, 0) for a, b in signs] + [(b, 0, a) for a, b in signs]
    near = 4 * s * s * 1.01  # every edge is 2s long; the next nearest vertices are 2sg apart
    adjacent = [[sum((p - q) ** 2 for p, q in zip(u, v)) < near for v in vertices] for u in vertices]
    triangles = []
    for i in range(12):
        for j in range(i + 1, 12):
            for k in range(j + 1, 12):
                if adjacent[i][j] and adjacent[j][k] and adjacent[i][k]:
                    outward = volume(vertices, [(i, j, k)]) > 0
                    triangles.append((i, j, k) if outward else (i, k, j))
    return vertices, triangles


def prism(outline, height):
    """Raises an outline of (x, z), counter-clockwise seen from above (x right, z down), star-shaped about the origin."""
    n = len(outline)
    vertices = [(x, y, z) for y in (-height / 2, height / 2) for x, z in [(0, 0)] + outline]
    triangles = []
    for i in range(n):
        a, b = 1 + i, 1 + (i + 1) % n
        top_a, top_b = a + n + 1, b + n + 1
        triangles += [(0, b, a), (n + 1, top_a, top_b), (a, b, top_b), (a, top_b, top_a)]
    return vertices, triangles


def star():
    """Five concave and five convex corners, for the fins of both."""
    corners = [(0.5 if i % 2 == 0 else 0.24, math.radians(90 + 36 * i)) for i in range(10)]
    return prism([(r * math.cos(a), -r * math.sin(a)) for r, a in corners], 1)


def wedge():
    """A blade with a point of 10 degrees, 3 long and 0.1 thick, its point at +x."""
    half_width = 3 * math.tan(math.radians(5))
    return prism([(2, 0), (-1, -half_width), (-1, half_width)], 0.1)


def double_torus():
    """Two rings side by side that share a wall, as the zero set of a function, meshed with surface nets."""
    ring, tube, blend = 0.8, 0.28, 0.2

    def distance(p):
        x, y, z = p
        rings = []
        for centre in (-ring, ring):
            from_ring = math.sqrt((x - centre) * (x - centre) + z * z) - ring
            rings.append(math.sqrt(from_ring * from_ring + y * y) - tube)
        overlap = max(blend - abs(rings[0] - rings[1]), 0.0)
        return min(rings) - overlap * overlap / (4 * blend)

    def onto_surface(p):
        step = 1e-4
        for _ in range(6):
            value = distance(p)
            slope = []
            for axis in range(3):
                ahead, behind = list(p), list(p)
                ahead[axis] += step
                behind[axis] -= step
                slope.append((distance(ahead) - distance(behind)) / (2 * step))
            square = sum(s * s for s in slope)
            p = tuple(c - value * s / square for c, s in zip(p, slope))
        return p

    return surface_net(distance, onto_surface, cell=0.08, half_cells=(25, 5, 15))


def surface_net(distance, onto_surface, cell, half_cells):
    """One vertex in every grid cell that the surface `distance` = 0 passes, one quad across every grid edge that it crosses."""
    nx, ny, nz = (2 * h for h in half_cells)

    # The grid is shifted by a fraction of a cell, lest its points fall on the shape's planes of symmetry.
    def point(i, j, k):
        return tuple((c - h + 0.37) * cell for c, h in zip((i, j, k), half_cells))

    inside = {(i, j, k): distance(point(i, j, k)) < 0
              for i in range(nx + 1) for j in range(ny + 1) for k in range(nz + 1)}
    vertices, of_cell = [], {}
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                corners = [(i + a, j + b, k + c) for a in (0, 1) for b in (0, 1) for c in (0, 1)]
                crossings = [tuple((u + v) / 2 for u, v in zip(point(*p), point(*q)))
                             for p in corners for q in corners
                             if p < q and sum(abs(u - v) for u, v in zip(p, q)) == 1 and inside[p] != inside[q]]
                if crossings:
                    of_cell[i, j, k] = len(vertices)
                    mean = tuple(sum(c) / len(crossings) for c in zip(*crossings))
                    vertices.append(onto_surface(mean))
    triangles = []
    for low in sorted(inside):
        for axis in range(3):
            high = tuple(c + (a == axis) for a, c in enumerate(low))
            if high not in inside or inside[low] == inside[high]:
                continue
            u, v = (axis + 1) % 3, (axis + 2) % 3  # right-handed: u × v points along the axis
            around = []
            for du, dv in ((-1, -1), (0, -1), (0, 0), (-1, 0)):
                of = list(low)
                of[u] += du
                of[v] += dv
                around.append(of_cell[tuple(of)])
            a, b, c, d = around if inside[low] else reversed(around)

            def length(p, q):
                return sum((s - t) ** 2 for s, t in zip(vertices[p], vertices[q]))

            # The shorter diagonal makes the rounder triangles.
            triangles += [(a, b, c), (a, c, d)] if length(a, c) <= length(b, d) else [(b, c, d), (b, d, a)]
    return vertices, triangles


def placed(mesh, scale, translation):
    vertices, triangles = mesh
    return [tuple(c * s + t for c, s, t in zip(v, scale, translation)) for v in vertices], triangles


def joined(*meshes):
    vertices, triangles = [], []
    for some_vertices, some_triangles in meshes:
        triangles += [tuple(i + len(vertices) for i in t) for t in some_triangles]
        vertices += some_vertices
    return vertices, triangles


def pillars():
    """Four things off the axis, standing at y = 0: turning them about y moves every shadow."""
    return joined(placed(box(), (0.5, 1.6, 0.5), (0.9, 0.8, 0)), placed(cylinder(), (0.5, 1.1, 0.5), (0, 0.55, 0.9)),
                  placed(cone(), (0.7, 1.3, 0.7), (-0.9, 0.65, 0)), placed(star(), (0.8, 0.5, 0.8), (0, 0.25, -0.9)))


MESHES = collections.OrderedDict([  # name: (mesh, what it is)
    ("ground", (ground(), "a quad facing up, -1 to 1 in x and z; the only open mesh")),
    ("box", (box(), "a cube, edge 1")),
    ("cylinder", (cylinder(), "diameter 1, height 1, 64 sides")),
    ("cone", (cone(), "diameter 1, height 1, 64 sides")),
    ("sphere", (sphere(), "diameter 1")),
    ("icosahedron", (icosahedron(), "in a sphere of diameter 1")),
    ("torus", (torus(), "axis y, outer diameter 2, tube diameter 0.5")),
    ("double_torus", (double_torus(), "two holes (genus 2), flat in xz, 3.8 by 2.2 by 0.6, surface nets of a distance function")),
    ("star", (star(), "a five-pointed prism: concave corners")),
    ("wedge", (wedge(), "a blade with a 10 degree point at +x")),
    ("pillars", (pillars(), "four solids round the y axis, standing at y = 0")),
])


def pieces(triangles):
    """The triangles, grouped by connected piece."""
    parent = {}

    def root(i):
        parent.setdefault(i, i)
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    for a, b, c in triangles:
        parent[root(b)] = root(a)
        parent[root(c)] = root(a)
    groups = collections.defaultdict(list)
    for t in triangles:
        groups[root(t[0])].append(t)
    return groups.values()


def assert_sound(name, vertices, triangles):
    """Every triangle has an area; a solid is closed, a two-manifold, consistently wound and turned outward."""
    assert len(set(vertices)) == len(vertices), f"{name}: two vertices share a position"
    for t in triangles:
        a, b, c = (vertices[i] for i in t)
        u, v = [q - p for p, q in zip(a, b)], [q - p for p, q in zip(a, c)]
        normal = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
        assert math.sqrt(sum(n * n for n in normal)) > 1e-6, f"{name}: triangle {t} has no area"
    if name == "ground":
        return
    directed = collections.Counter(e for a, b, c in triangles for e in ((a, b), (b, c), (c, a)))
    for (a, b), count in directed.items():
        assert count == 1 and directed.get((b, a)) == 1, f"{name}: edge {a}-{b} does not have two faces that run against each other"
    # At a vertex, the faces must form one fan: walk round it from spoke to spoke and see that the walk meets every face.
    spokes = collections.defaultdict(dict)
    for a, b, c in triangles:
        for centre, start, stop in ((a, b, c), (b, c, a), (c, a, b)):
            spokes[centre][start] = stop
    assert len(spokes) == len(vertices), f"{name}: a vertex without a face"
    for centre, after in spokes.items():
        start = next(iter(after))
        spoke, steps = after[start], 1
        while spoke != start:
            spoke, steps = after[spoke], steps + 1
        assert steps == len(after), f"{name}: vertex {centre} joins two fans"
    for piece in pieces(triangles):
        assert volume(vertices, piece) > 0, f"{name}: a piece is turned inside out"


def obj_text(name, mesh, words):
    lines = [f"# {name}: {words}", "# made by data/make_scenes.py"]
    lines += ["v " + " ".join(number(c) for c in v) for v in mesh[0]]
    lines += ["f " + " ".join(str(i + 1) for i in t) for t in mesh[1]]
    # What is checked is what a reader of the file will see, rounding included.
    rounded = [tuple(float(w) for w in line.split()[1:]) for line in lines if line.startswith("v ")]
    assert_sound(name, rounded, mesh[1])
    return "\n".join(lines) + "\n"


# ---- scenes -----------------------------------------------------------------------------------------------------------------

GREY, CLAY, TEAL, OCHRE = [0.46, 0.44, 0.41], [0.5, 0.19, 0.12], [0.12, 0.34, 0.36], [0.58, 0.37, 0.11]
SAGE, PLUM, SLATE, ROSE = [0.24, 0.4, 0.2], [0.31, 0.16, 0.34], [0.17, 0.25, 0.44], [0.56, 0.27, 0.27]


def mesh(name, file, color, translation=(0, 0, 0), rotation_deg=(0, 0, 0), scale=(1, 1, 1)):
    path = file if file.startswith("/") else f"../meshes/{file}.obj"
    return {"name": name, "path": path, "translation": list(translation), "rotation_deg": list(rotation_deg),
            "scale": list(scale), "base_color": color}


def floor(half_width=12, color=GREY):
    return mesh("ground", "ground", color, scale=(half_width, 1, half_width))


def camera(position, target, yfov_deg=35):
    return {"position": position, "target": target, "up": [0, 1, 0], "yfov_deg": yfov_deg, "znear": 0.1, "zfar": 100,
            "resolution": [1024, 1024]}


def spot(position, target, radius, cone_deg=80):
    return [{"name": "key", "type": "spot", "position": position, "target": target, "radius": radius, "cone_deg": cone_deg,
             "color": [1, 1, 1], "intensity": 1}]


def scene(figure, shows, meshes, camera, lights, animation=None):
    content = {"meshes": meshes, "camera": camera, "lights": lights, "ambient": [0.1, 0.1, 0.11]}
    if animation:
        content["animation"] = animation
    return {"figure": figure, "shows": shows, "content": content}


def cylinder_scene(radius, shows):
    return scene("Chan 7, 8", shows, [floor(), mesh("cylinder", "cylinder", CLAY, [0, 1, 0], scale=[1, 2, 1])],
                 camera([-2.2, 7, 4.4], [-0.95, 0.5, -0.3]), spot([4.5, 7, 2], [0, 0.5, 0], radius))


SCENES = collections.OrderedDict([
    ("cylinder", cylinder_scene(0.12, "An upright cylinder, small light: the shadow is sharp at the foot and widens with distance")),
    ("cylinder-medium-light", cylinder_scene(0.4, "The same, light radius 0.4: the umbra narrows")),
    ("cylinder-large-light", cylinder_scene(1.0, "The same, light radius 1: the umbra ends before the hard shadow does")),
    ("boxes", scene(
        "Chan 9", "Box 1 casts on box 2 and on the ground: one silhouette, two receivers, two penumbra widths",
        [floor(), mesh("box-1", "box", CLAY, [-0.55, 2.5, 0], [0, 20, 0], [1.5, 0.4, 1.5]),
         mesh("box-2", "box", SLATE, [0.6, 1.1, 0.1], [0, -8, 0], [1.7, 0.6, 1.9])],
        camera([1.4, 7, 5.6], [0.05, 0.9, 0.1]), spot([-0.8, 9, -1.5], [0, 0.8, 0], 0.35, 90))),
    ("overlap", scene(
        "Chan 10", "Two blockers at different heights overlap as seen from the light: their penumbrae cross",
        [floor(), mesh("low-box", "box", TEAL, [-0.55, 1.0, 0], [0, 35, 0], [1.5, 0.25, 1.5]),
         mesh("high-box", "box", OCHRE, [0.75, 1.7, 0.1], [0, -15, 0], [1.5, 0.25, 1.5])],
        camera([-0.8, 7.2, 4.8], [-0.3, 0.6, 0.2]), spot([3, 8, -1.5], [0, 0.5, 0], 0.35))),
    ("primitives", scene(
        "Chan 1d", "A group of simple solids, curved and flat, that shade the ground and each other",
        [floor(),
         mesh("cylinder", "cylinder", CLAY, [-2.1, 1, -1.2], scale=[1, 2, 1]),
         mesh("sphere", "sphere", TEAL, [0, 0.8, 0.3], scale=[1.6, 1.6, 1.6]),
         mesh("cone", "cone", OCHRE, [1.9, 0.85, -0.6], scale=[1.3, 1.7, 1.3]),
         mesh("torus", "torus", PLUM, [-1.5, 0.25, 1.5]),
         mesh("ring", "torus", SAGE, [0.1, 1.25, -2.2], [90, 0, 0], [1.25, 1.25, 1.25]),
         mesh("box", "box", SLATE, [1.6, 0.45, 1.3], [0, 30, 0], [0.9, 0.9, 0.9]),
         mesh("icosahedron", "icosahedron", ROSE, [2.6, 1.1, -2.4], [0, 0, 0], [1.1, 1.1, 1.1])],
        camera([-0.8, 9, 9], [-0.45, 0.4, -0.6]), spot([4, 9, 2], [0, 1, -0.5], 0.4, 102))),
    ("torus", scene(
        "Cai 7", "A two-holed torus shades a raised plane, and the raised plane alone the ground: one layer of fins lets the "
        "torus show through on the ground, where all is umbra",
        [floor(), mesh("raised-plane", "ground", SAGE, [0, 1.8, 0], scale=[2.3, 1, 1.7]),
         mesh("torus", "double_torus", CLAY, [-0.15, 2.9, -0.65], [0, 12, 0], [0.85, 0.85, 0.85])],
        camera([0.9, 9.2, 8.2], [0.3, 1, 0.8]), spot([-1.2, 9, -4.5], [0, 0.8, 0.8], 0.35, 112))),
    ("near-boxes", scene(
        "Cai 10", "Two boxes close together: the lit strip between their hard shadows is narrower than the penumbra",
        [floor(), mesh("left-box", "box", TEAL, [-0.58, 1.2, 0], [0, 0, 0], [1.1, 0.9, 1.1]),
         mesh("right-box", "box", CLAY, [0.58, 1.2, 0], [0, 0, 0], [1.1, 0.9, 1.1])],
        camera([0.7, 6.4, 5.2], [0, 0.5, 0.6]), spot([0, 8, -3.2], [0, 0.5, 0], 0.45))),
    ("sharp-corner", scene(
        "Cai 13", "A silhouette corner of 10 degrees: quads and sectors of fins distort the shadow of the point",
        [floor(), mesh("wedge", "wedge", PLUM, [-0.6, 1.5, 0], [0, 20, 0])],
        camera([0.3, 5.6, 4.4], [-0.15, 0.5, 0.15]), spot([-0.5, 8, -2.5], [0, 0, 0], 0.3))),
    ("tilted", scene(
        "Cai 9", "A receiver that is not parallel to the light's plane: the penumbra widens along it",
        [floor(), mesh("tilted-plane", "box", SAGE, [0, 1.05, 0], [0, 0, -25], [4, 0.1, 3]),
         mesh("bar", "box", CLAY, [-0.15, 2.45, -0.05], [0, 25, 0], [2.3, 0.25, 0.6])],
        camera([1.2, 8.2, 6.4], [-0.1, 0.9, 0.1]), spot([-0.5, 8.5, -1.5], [0, 0.5, 0], 0.35, 95))),
    ("large-light", scene(
        "Cai 8", "A light wider than the caster: no point of the ground is in umbra",
        [floor(), mesh("box", "box", SLATE, [0, 2.4, 0], [0, 30, 0], [0.6, 0.6, 0.6])],
        camera([0.4, 6.4, 4.6], [-0.25, 0.8, 0.1]), spot([1.5, 8, -1], [0, 0.5, 0], 1.5))),
    ("bunny", scene(
        "", "Many small silhouettes, some in front of others: a scanned bunny on the ground",
        [floor(), mesh("bunny", BUNNY_PATH, [0.66, 0.56, 0.46], [0, 0.99, 0])],
        camera([-1.6, 5, 5], [-0.55, 0.7, -0.1]), spot([3.5, 7, 2.5], [0, 0.8, 0], 0.3, 90))),
    ("sun", scene(
        "", "A directional light, low and three degrees wide: shadows of a colonnade grow softer with their length",
        [floor(), mesh("pillars", "pillars", OCHRE, [0, 0, 0], [0, 20, 0], [1.6, 1.6, 1.6]),
         mesh("box", "box", CLAY, [0, 1.9, 0], [0, 20, 0], [2.6, 0.2, 2.6])],
        camera([-1.6, 7.5, 8], [-0.6, 0.6, -0.3]),
        [{"name": "sun", "type": "directional", "direction": [-3, -4, -1.5], "angular_radius_deg": 3,
         "color": [1, 1, 1], "intensity": 1}])),
    ("lamp", scene(
        "", "A point light amid its casters: their shadows lie all around it, over the borders of its six maps",
        [floor(), mesh("cylinder", "cylinder", CLAY, [-2, 0.8, -1], [0, 0, 0], [0.7, 1.6, 0.7]),
         mesh("box", "box", SLATE, [1.5, 0.7, 1.3], [0, 30, 0], [0.9, 0.9, 0.9]),
         mesh("ring", "torus", SAGE, [1.6, 1.1, -1.7], [90, 0, 40])],
        camera([-0.4, 9.5, 8], [0, 0.2, 0]),
        [{"name": "lamp", "type": "point", "position": [0, 2.2, 0], "radius": 0.2,
         "color": [1, 1, 1], "intensity": 1}])),
    ("turntable", scene(
        "", "Animation, frames 1 to 24: solids turn on a disc while a box slides over them",
        [floor(), mesh("disc", "cylinder", SAGE, [0, 0.1, 0], scale=[3, 0.2, 3]),
         mesh("pillars", "pillars", OCHRE, [0, 0.2, 0]),
         mesh("box", "box", CLAY, [-1.3, 2.4, 0], [0, 0, 0], [0.8, 0.3, 0.8])],
        camera([-0.8, 8, 6.5], [-0.4, 0.7, 0]), spot([2, 9, 1], [0, 0.5, 0], 0.35, 90),
        # 345, not 360: frame 25 would be frame 1 again, so the film loops without a stutter.
        {"frames": [1, 24], "tracks": [
            {"target": "disc.rotation_deg", "keys": [[1, [0, 0, 0]], [24, [0, 345, 0]]]},
            {"target": "pillars.rotation_deg", "keys": [[1, [0, 0, 0]], [24, [0, 345, 0]]]},
            {"target": "box.translation", "keys": [[1, [-1.3, 2.4, 0]], [13, [1.3, 2.4, 0]], [24, [-1.1, 2.4, 0]]]}]})),
])


def json_text(content):
    """JSON with one mesh, light, camera or track a line."""
    def line(value):
        return json.dumps(value, separators=(", ", ": "))

    def rows(values, indent):
        return "[\n" + ",\n".join(" " * (indent + 2) + line(v) for v in values) + "\n" + " " * indent + "]"

    parts = []
    for key, value in content.items():
        if key in ("meshes", "lights"):
            text = rows(value, 2)
        elif key == "animation":
            text = f'{{"frames": {line(value["frames"])}, "tracks": {rows(value["tracks"], 2)}}}'
        else:
            text = line(value)
        parts.append(f'  "{key}": {text}')
    text = "{\n" + ",\n".join(parts) + "\n}\n"
    assert json.loads(text) == content
    return text


# ---- README tables ----------------------------------------------------------------------------------------------------------

def triangle_count(mesh_path):
    return BUNNY_TRIANGLES if mesh_path == BUNNY_PATH else len(MESHES[os.path.basename(mesh_path)[:-4]][0][1])


def scene_table():
    rows = ["| scene | what it shows | figure | triangles |", "|---|---|---|---:|"]
    for name, s in SCENES.items():
        count = sum(triangle_count(m["path"]) for m in s["content"]["meshes"])
        rows.append(f"| `{name}` | {s['shows']} | {s['figure'] or '–'} | {count:,} |")
    return "\n".join(rows)


def mesh_table():
    rows = ["| mesh | what it is | triangles |", "|---|---|---:|"]
    rows += [f"| `{name}.obj` | {words} | {len(m[1]):,} |" for name, (m, words) in MESHES.items()]
    return "\n".join(rows)


def readme_text(old):
    if old is None:
        raise SystemExit("data/README.md: missing; the tables are written into its text, so bring the text back first")
    for key, table in (("scenes", scene_table()), ("meshes", mesh_table())):
        begin, end = f"<!-- {key}: written by make_scenes.py -->\n", f"\n<!-- end of {key} -->"
        before, rest = old.split(begin)
        _, after = rest.split(end)
        old = before + begin + table + end + after
    return old


# ---- files ------------------------------------------------------------------------------------------------------------------

def read(path):
    try:
        with open(path, encoding="utf-8", newline="") as file:
            return file.read()
    except FileNotFoundError:
        return None


def wanted_files():
    files = {os.path.join("meshes", f"{name}.obj"): obj_text(name, m, words) for name, (m, words) in MESHES.items()}
    files.update({os.path.join("scenes", f"{name}.json"): json_text(s["content"]) for name, s in SCENES.items()})
    files["README.md"] = readme_text(read(os.path.join(HERE, "README.md")))
    return files


def main(arguments):
    if arguments not in ([], ["--check"]):
        print("usage: make_scenes.py [--check]", file=sys.stderr)
        return 2
    files = wanted_files()
    if not arguments:
        for path, text in files.items():
            os.makedirs(os.path.dirname(os.path.join(HERE, path)), exist_ok=True)
            with open(os.path.join(HERE, path), "w", encoding="utf-8", newline="") as file:
                file.write(text)
        return 0
    wrong = []
    for path, text in files.items():
        found = read(os.path.join(HERE, path))
        if found != text:
            wrong.append(f"data/{path}: " + ("missing" if found is None else "differs from what make_scenes.py writes"))
    for folder in ("meshes", "scenes"):  # a file that the script no longer makes would go stale unnoticed
        there = os.path.join(HERE, folder)
        for name in sorted(os.listdir(there)) if os.path.isdir(there) else []:
            if os.path.join(folder, name) not in files:
                wrong.append(f"data/{folder}/{name}: not made by make_scenes.py")
    if wrong:
        print("\n".join(wrong) + "\nrun data/make_scenes.py, or undo the edit", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
