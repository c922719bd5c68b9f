#!/usr/bin/env python3
"""Learns where a head that has all of ARKit's 52 shapes has the markers of the default layout, and what each shape does to them.

    tools/learn_arkit_markers.py HEAD.glb > sample_data/arkit/face66_shapes.json

The head's anchors lie beside it. A Live Link recording in which one shape after the other is at 1 is put on the head by
`corpus convert`; what its markers then move by, against rest, is the shape (millimetres of the head, Y up, Z out of the face).
"""
import json
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
HEAD_AND_EYES = "HeadYaw HeadPitch HeadRoll LeftEyeYaw LeftEyePitch LeftEyeRoll RightEyeYaw RightEyePitch RightEyeRoll"


def arkit_names():
    text = (ROOT / "src/motion/arkit_shapes.h").read_text()
    listed = text[text.index("kArkitNames{"):]
    return [name for name in listed[:listed.index("}")].split('"')[1::2]]


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
    markers = [column[:-2] for column in header.split(",")[1::3]]
    frames = [[float(x) for x in line.split(",")[1:]] for line in lines]
    moves = {name: [round(a - b, 3) for a, b in zip(frames[k + 1], frames[0])] for k, name in enumerate(names)}
    shapes = ",\n".join(f"  {json.dumps(name)}: {json.dumps(move, separators=(',', ':'))}" for name, move in moves.items())
    print('{"credit": "learnt from ICT-FaceKit\'s head (USC Institute for Creative Technologies, MIT licence)",')
    print(f' "markers": {json.dumps(markers, separators=(",", ":"))},\n '
          f'"neutral_mm": {json.dumps([round(x, 3) for x in frames[0]], separators=(",", ":"))},\n "moves_mm": {{\n{shapes}\n}}}}')


if __name__ == "__main__":
    main()
