#!/usr/bin/python3
"""Prints what a reader of a guide has at hand and a test has not: a landmark track of the default face at rest, a second
at 25 frames. Its first vertices are MediaPipe's landmarks.
"""
import json
import pathlib

LANDMARKS = 468


def track():
    lines = pathlib.Path("build/share/mouthpiece/default.obj").read_text().splitlines()
    points = [[float(x) for x in line.split()[1:4]] for line in lines if line.startswith("v ")][:LANDMARKS]
    face = [[200 + x, 200 - y, -z] for x, y, z in points]
    return {"fps": 25, "frames": [face] * 25}


print(json.dumps(track()))
