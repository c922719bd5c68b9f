#!/usr/bin/python3
"""Fitted heads in twelve poses on one sheet, from the front and from the side: a picture to look at.

    face_sheet.py --bin build/bin --out sheet.png default.face ict.face ...

Each head says a line (`synth`); its poses are those in the middle of a B, P, M, F, V, W, UW, OW, AA, IY, TH and at rest.
Needs numpy. Drawn by points: each triangle is filled with as many as it has pixels.
"""
import argparse
import pathlib
import re
import struct
import subprocess
import tempfile
import zlib

import numpy

LINE = "a bee, a pea, my fee, above, we, who, oh, father, see, the thumb"
POSES = ["rest", "B", "P", "M", "F", "V", "W", "UW", "OW", "AA", "IY", "TH"]
WIDTH, HEIGHT = 150, 120
BACKGROUND = (231, 229, 225)
SKIN = (0.75, 0.5, 0.4)
COLOURS = {"teeth": (0.9, 0.9, 0.85), "tongue": (0.7, 0.25, 0.25), "lips": (0.66, 0.32, 0.29), "gum": (0.6, 0.25, 0.25),
           "mouth": (0.15, 0.04, 0.04)}


def read_usda(path):
    """The head at rest as `synth -o face.usda` writes it, whatever file it came from: vertices, triangles, a colour a
    triangle by its part's name."""
    text = pathlib.Path(path).read_text()

    def numbers(pattern, kind, within):
        listed = re.search(pattern + r" = \[(.*?)\]", within).group(1)
        return numpy.array(re.sub(r"[(),]", " ", listed).split(), kind)

    vertices = numbers(r"point3f\[\] points", float, text).reshape(-1, 3)
    triangles = numbers(r"int\[\] faceVertexIndices", int, text).reshape(-1, 3)
    names = dict(re.findall(r'def Material "(\w+)" \(\s*displayName = "(.*?)"', text))
    colours = numpy.tile(numpy.array(SKIN), (len(triangles), 1))
    for subset in re.split(r"def GeomSubset ", text)[1:]:
        name = names.get(re.search(r"</[^>]*/Materials/(\w+)>", subset).group(1), "").lower()
        colours[numbers(r"int\[\] indices", int, subset)] = next((c for part, c in COLOURS.items() if part in name), SKIN)
    return vertices, triangles, colours


def read_pc2(path):
    data = pathlib.Path(path).read_bytes()
    count, = struct.unpack("<i", data[16:20])
    frames, = struct.unpack("<i", data[28:32])
    return numpy.frombuffer(data, numpy.float32, offset=32).reshape(frames, count, 3).astype(float)


def phones_of(text_grid):
    tier = re.search(r'name = "phones".*?(?=item \[|$)', text_grid, re.S).group(0)
    found = re.findall(r'xmin = ([\d.]+)\s+xmax = ([\d.]+)\s+text = "(.*?)"', tier)
    return [(0.5 * (float(a) + float(b)), name) for a, b, name in found]


def draw(vertices, triangles, colours, middle, width, side):
    """A picture of what lies within `width` of `middle`, HEIGHT x WIDTH x 3."""
    turn = numpy.radians(82 if side else 0)  # straight from the front, evenly lit: a lopsided mouth shows
    right = numpy.array([numpy.cos(turn), 0, -numpy.sin(turn)])
    back = numpy.array([numpy.sin(turn), 0, numpy.cos(turn)])
    seen = vertices - middle
    scale = WIDTH / width
    x, y, z = WIDTH / 2 + scale * seen @ right, HEIGHT / 2 - scale * seen[:, 1], seen @ back
    corners = numpy.stack([x, y, z], axis=1)[triangles]
    is_in = ((corners[:, :, 0].max(1) > 0) & (corners[:, :, 0].min(1) < WIDTH) &
             (corners[:, :, 1].max(1) > 0) & (corners[:, :, 1].min(1) < HEIGHT))
    faces = numpy.cross(vertices[triangles[:, 1]] - vertices[triangles[:, 0]],
                        vertices[triangles[:, 2]] - vertices[triangles[:, 0]])
    normals = numpy.zeros_like(vertices)
    for corner in range(3):
        numpy.add.at(normals, triangles[:, corner], faces)
    depth = numpy.full(WIDTH * HEIGHT, -numpy.inf)
    picture = numpy.tile(numpy.array(BACKGROUND, float), (WIDTH * HEIGHT, 1))
    size = numpy.ptp(corners[:, :, :2], axis=1).max(1)
    steps = numpy.clip(numpy.ceil(2 * size).astype(int) + 1, 2, 64)
    for count in numpy.unique(steps[is_in]):
        chosen = numpy.flatnonzero(is_in & (steps == count))
        grid = numpy.array([(i, j, count - i - j) for i in range(count + 1) for j in range(count + 1 - i)]) / count
        for some in numpy.array_split(chosen, max(1, len(chosen) * len(grid) // 2_000_000)):
            places = numpy.einsum("gk,tkd->tgd", grid, corners[some]).reshape(-1, 3)
            shades = numpy.einsum("gk,tkd->tgd", grid, normals[triangles[some]]).reshape(-1, 3)
            shades /= numpy.maximum(numpy.linalg.norm(shades, axis=1, keepdims=True), 1e-12)
            towards = shades @ back
            shades[towards < 0] *= -1
            lamp = back + numpy.array([0, 0.6, 0]) - (0.6 * right if side else 0)
            light = shades @ lamp / numpy.linalg.norm(lamp)
            light = numpy.where(towards < 0, 0.55, 1) * (0.22 + 0.78 * numpy.maximum(light, 0))
            column, row = numpy.floor(places[:, 0]).astype(int), numpy.floor(places[:, 1]).astype(int)
            inside = (column >= 0) & (column < WIDTH) & (row >= 0) & (row < HEIGHT)
            at = (row * WIDTH + column)[inside]
            far = places[inside, 2]
            colour = 255 * (numpy.repeat(colours[some], len(grid), axis=0)[inside] * light[inside, None]) ** 0.4545
            order = numpy.argsort(far)  # of several writes to one place the last one stays
            at, far, colour = at[order], far[order], colour[order]
            nearest = numpy.full(WIDTH * HEIGHT, -1)
            nearest[at] = numpy.arange(len(at))
            wins = numpy.flatnonzero(nearest >= 0)
            wins = wins[far[nearest[wins]] > depth[wins]]
            depth[wins], picture[wins] = far[nearest[wins]], colour[nearest[wins]]
    return picture.reshape(HEIGHT, WIDTH, 3).astype(numpy.uint8)


def write_png(path, picture):
    height, width, _ = picture.shape
    rows = b"".join(b"\0" + picture[i].tobytes() for i in range(height))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    pathlib.Path(path).write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) +
                                   chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


def rows_of(face, bin_folder):
    """Two rows of pictures: from the front and from the side."""
    with tempfile.TemporaryDirectory() as scratch:
        cache, labels, head = f"{scratch}/talk.pc2", f"{scratch}/phones.TextGrid", f"{scratch}/head.usda"
        subprocess.run([f"{bin_folder}/synth", "--text", LINE, "--face", face, "-o", cache, "-o", labels, "-o", head, "-q"],
                       check=True)
        frames, phones = read_pc2(cache), phones_of(pathlib.Path(labels).read_text())
        vertices, triangles, colours = read_usda(head)
    # It is in metres, the point cache in the file's unit; most of a head does not move.
    lengths = numpy.linalg.norm(vertices, axis=1)
    vertices *= numpy.median(numpy.linalg.norm(frames[0], axis=1) / numpy.maximum(lengths, 1e-9))
    moved = numpy.ptp(frames, axis=0).max(1)
    is_skin = numpy.zeros(len(vertices), bool)
    is_skin[triangles[(colours == SKIN).all(1) | (colours == COLOURS["lips"]).all(1)]] = True
    moved[~is_skin] = 0
    lips = frames[0][moved > 0.6 * moved.max()]  # in no other place does a talking face's skin move more
    # A head may come with hair and a body: how wide it is tells nothing, how wide its talking skin is does.
    middle, width = lips.mean(0), 0.7 * numpy.ptp(frames[0][moved > 0.15 * moved.max(), 0])
    rows = [[], []]
    for pose in POSES:
        time = next((t for t, name in phones if name.rstrip("012") == pose), None)
        # A line begins at rest. The USD head is upright, the point cache turned as its file is.
        frame = frames[0 if time is None else min(len(frames) - 1, round(60 * time))]
        for side in (0, 1):
            rows[side].append(draw(frame, triangles, colours, middle, width, side))
    return [numpy.concatenate(row, axis=1) for row in rows]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", default="build/bin")
    parser.add_argument("--out", default="sheet.png")
    parser.add_argument("faces", nargs="+", help=".face files fitted to meshes that stand upright")
    given = parser.parse_args()
    rows = []
    for face in given.faces:
        rows += rows_of(face, given.bin)
    write_png(given.out, numpy.concatenate(rows, axis=0))
    print(f"{given.out}: {', '.join(POSES)}; a head in two rows: {', '.join(map(str, given.faces))}")


if __name__ == "__main__":
    main()
