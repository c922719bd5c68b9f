#!/usr/bin/env python3
"""Learns where a head that has all of ARKit's 52 shapes has the markers of the default layout, and what each shape does to them.

    tools/learn_arkit_markers.py HEAD.glb > sample_data/arkit/face66_shapes.json

The head's anchors lie beside it. A Live Link recording in which one shape after the other is at 1 is put on the head by
`corpus convert`; what its markers then move by, against rest, is the shape (millimetres of the head, Y up, Z out of the face). How far it parts the
lips' rims, which no marker sees, is told by the vertices next to those that `retarget fit` finds: right, middle, left.
"""
import json
import math
import pathlib
import struct
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
HEAD_AND_EYES = "HeadYaw HeadPitch HeadRoll LeftEyeYaw LeftEyePitch LeftEyeRoll RightEyeYaw RightEyePitch RightEyeRoll"


def arkit_names():
    text = (ROOT / "src/motion/arkit_shapes.h").read_text()
    listed = text[text.index("kArkitNames{"):]
    return [name for name in listed[:listed.index("}")].split('"')[1::2]]


def morphs(path):
    """Vertices and what each shape adds, by name, of a GLB's first mesh, its unit."""
    data = pathlib.Path(path).read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    tree, buffer = json.loads(data[20:20 + length]), data[20 + length + 8:]

    def places(number):
        accessor = tree["accessors"][number]
        view = tree["bufferViews"][accessor["bufferView"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        return [struct.unpack_from("<3f", buffer, start + 12 * i) for i in range(accessor["count"])]

    mesh = tree["meshes"][0]
    primitive = mesh["primitives"][0]
    shapes = {name: places(target["POSITION"]) for name, target in zip(mesh["extras"]["targetNames"], primitive["targets"])}
    return places(primitive["attributes"]["POSITION"]), shapes


def rims_parted(path, names, scratch):
    """Of each shape by how many mm of height it parts the rims in three places."""
    anchors = pathlib.Path(scratch, "rims.json")
    subprocess.run([ROOT / "build/bin/retarget", "fit", "--mesh", path, "--corpus", ROOT / "build/share/mouthpiece/clock.corpus",
                    "--out", pathlib.Path(scratch, "head.face"), "--save-anchors", anchors, "--quiet"], check=True)
    found = json.loads(anchors.read_text())["markers"]
    vertices, shapes = morphs(path)
    nearest = lambda name: min(range(len(vertices)), key=lambda v: math.dist(vertices[v], found[name]))
    pairs = [(nearest(f"RIM_UP_{at}"), nearest(f"RIM_LO_{at}")) for at in ("IN_R", "MID", "IN_L")]
    plain = lambda name: (name[:-2] + {"_L": "Left", "_R": "Right"}[name[-2:]] if name[-2:] in ("_L", "_R") else name).lower()
    parted = dict.fromkeys((name.lower() for name in names), (0.0, 0.0, 0.0))
    for name, move in shapes.items():
        for apple in (plain(name), plain(name).removesuffix("left").removesuffix("right")):
            if apple in parted:
                own = (1000 * (move[upper][1] - move[lower][1]) for upper, lower in pairs)
                parted[apple] = tuple(round(a + b, 3) for a, b in zip(parted[apple], own))
                break
    return {name: parted[name.lower()] for name in names}


def main():
    names = arkit_names()
    with tempfile.TemporaryDirectory() as scratch:
        recording, out = pathlib.Path(scratch, "arkit.csv"), pathlib.Path(scratch, "markers.csv")
        rows = ["Timecode,BlendShapeCount," + ",".join(names + HEAD_AND_EYES.split())]
        for frame in range(len(names) + 1):
            weights = ["1" if k + 1 == frame else "0" for k in range(len(names))] + ["0"] * 9
            rows.append(f"00:00:{frame // 30:02}:{frame % 30:02}.000,61," + ",".join(weights))
        recording.write_text("\n".join(rows) + "\n")
        subprocess.run([ROOT / "build/bin/corpus", "convert", recording, out, "--arkit-head", sys.argv[1], "--fps", "30",
                        "--quiet"], check=True)
        header, *lines = out.read_text().splitlines()
        rims = rims_parted(sys.argv[1], names, scratch)
    markers = [column[:-2] for column in header.split(",")[1::3]]
    frames = [[float(x) for x in line.split(",")[1:]] for line in lines]
    moves = {name: [round(a - b, 3) for a, b in zip(frames[k + 1], frames[0])] for k, name in enumerate(names)}
    shapes = ",\n".join(f"  {json.dumps(name)}: {json.dumps(move, separators=(',', ':'))}" for name, move in moves.items())
    print('{"credit": "learnt from ICT-FaceKit\'s head (USC Institute for Creative Technologies, MIT licence)",')
    print(f' "markers": {json.dumps(markers, separators=(",", ":"))},\n '
          f'"neutral_mm": {json.dumps([round(x, 3) for x in frames[0]], separators=(",", ":"))},\n "moves_mm": {{\n{shapes}\n}},')
    print(f' "rims_parted_mm": {json.dumps(rims, separators=(",", ":"))}}}')


if __name__ == "__main__":
    main()
