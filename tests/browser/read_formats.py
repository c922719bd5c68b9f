"""What Debian's readers (Praat, ffmpeg, YAML, XML, JSON) and readings by the formats' own manuals find in a line's files:
read_formats.py FOLDER (a line as line.ENDING). 77 where Praat, ffmpeg or PyYAML is missing."""
import csv
import json
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import xml.etree.ElementTree as xml

folder = pathlib.Path(sys.argv[1])


def skip(why):
    print("skipped:", why)
    sys.exit(77)


try:
    import yaml
except ImportError:
    skip("no PyYAML; get it with: sudo apt-get install python3-yaml")
for program in ("praat", "ffmpeg"):
    if not shutil.which(program):
        skip(f"no {program}; get it with: sudo apt-get install {program}")
if not (folder / "line.json").exists():
    skip(f"no line in {folder}")


def path(ending):
    return str(folder / ("line." + ending))


def text(ending):
    return (folder / ("line." + ending)).read_text(encoding="utf-8")


def near(found, expected, within, what):
    assert len(found) == len(expected), f"{what}: {len(found)} of {len(expected)}"
    off = max((abs(a - b) for a, b in zip(found, expected)), default=0)
    assert off <= within, f"{what}: {off} off"


report = json.loads(text("json"))
frames, rate = report["frames"], report["fps"]
words = report["text"].split()

# Sound, labels, subtitles: Praat and ffmpeg.
script = folder / "read.praat"
script.write_text('form Read\n  sentence Labels\n  sentence Sound\nendform\nRead from file: labels$\n'
                  'tiers = Get number of tiers\nfor t to tiers\n  name$ = Get tier name: t\n  n = Get number of intervals: t\n'
                  '  for i to n\n    end = Get end time of interval: t, i\n    label$ = Get label of interval: t, i\n'
                  '    appendInfoLine: name$, tab$, fixed$(end, 6), tab$, label$\n  endfor\nendfor\n'
                  'Read from file: sound$\nend = Get total duration\nappendInfoLine: "sound", tab$, fixed$(end, 6), tab$, ""\n')
told = subprocess.run(["praat", "--run", str(script), path("TextGrid"), path("wav")], capture_output=True, text=True, check=True).stdout
rows = [line.split("\t") for line in told.splitlines()]
ends = [float(row[1]) for row in rows if row[0] == "phones"]
near(ends, [phone["end_s"] for phone in report["phones"]], 1e-4, "Praat's ends of phones")
assert [row[2] for row in rows if row[0] == "words" and row[2]] == words, told
assert abs(float(rows[-1][1]) - report["duration_s"]) < 0.1, rows[-1]
for ending, other in (("srt", "webvtt"), ("vtt", "srt")):
    cue = subprocess.run(["ffmpeg", "-v", "error", "-i", path(ending), "-f", other, "-"], capture_output=True, text=True, check=True).stdout
    assert " ".join(words) in cue and cue.count("-->") == 1, cue
times = [subprocess.run(["ffprobe", "-v", "error", "-show_entries", "packet=pts_time,duration_time", "-of", "csv=p=0", path(ending)],
                        capture_output=True, text=True, check=True).stdout for ending in ("srt", "vtt")]
assert times[0] == times[1], times

# Mouths: the same cues in Rhubarb's three formats; Moho's on frames of 24 a second.
cues = [(float(a), b) for a, b in (line.split("\t") for line in text("tsv").splitlines())]
root = xml.parse(path("xml")).getroot()
assert root.tag == "rhubarbResult" and float(root.find("metadata/duration").text) == cues[-1][0]
in_xml = [(float(cue.get("start")), float(cue.get("end")), cue.text) for cue in root.find("mouthCues")]
in_json = [(cue["start"], cue["end"], cue["value"]) for cue in json.loads(text("rhubarb.json"))["mouthCues"]]
assert in_xml == in_json == [(a, b, shape) for (a, shape), (b, _) in zip(cues, cues[1:])], (in_xml, in_json, cues)
moho = text("dat").splitlines()
assert moho[0] == "MohoSwitch1"
switch = [line.split(" ") for line in moho[1:]]
numbers = [int(number) for number, _ in switch]
assert numbers == sorted(set(numbers)) and numbers[0] == 1 and numbers[-1] <= round(24 * cues[-1][0]) + 1, numbers
assert {mouth for _, mouth in switch} <= {"MBP", "etc", "E", "AI", "O", "U", "FV", "L", "WQ", "rest"}, switch

# ARKit's weights: all programs' files tell the same curves.
arkit = json.loads(text("arkit.json"))
names, weights = arkit["names"], arkit["frames"]
assert len(names) == 52 and len(weights) == frames and arkit["fps"] == rate
a2f = json.loads(text("a2f.json"))
assert a2f["facsNames"] == names and a2f["weightMat"] == weights and a2f["exportFps"] == rate
live = list(csv.DictReader(open(path("arkit.csv"), encoding="utf-8")))
assert len(live) == frames and {row["BlendShapeCount"] for row in live} == {"61"}
controls = json.loads(text("metahuman.json"))
in_csv = list(csv.DictReader(open(path("metahuman.csv"), encoding="utf-8")))
assert list(in_csv[0])[1:] == controls["names"]


def column(name):
    return [row[names.index(name)] for row in weights]


def between(keys):
    """A value a frame, on straight lines between keys (time in frames, value)."""
    values, k = [], 0
    for frame in range(frames):
        while k + 2 < len(keys) and keys[k + 1][0] < frame:
            k += 1
        (a, first), (b, last) = keys[k], keys[min(k + 1, len(keys) - 1)]
        values.append(first + (last - first) * (frame - a) / (b - a) if b > a else first)
    return values


for name in names:
    near([float(row[name[0].upper() + name[1:]]) for row in live], column(name), 1e-6, "Live Link Face " + name)
near([row[controls["names"].index("CTRL_expressions_jawOpen")] for row in controls["frames"]], column("jawOpen"), 0, "MetaHuman")


class UnityLoader(yaml.SafeLoader):
    """Unity's tag names a class; what follows is a plain mapping."""


UnityLoader.add_multi_constructor("tag:unity3d.com,2011:", lambda loader, tag, node: loader.construct_mapping(node, deep=True))
clip = yaml.load(text("anim"), UnityLoader)["AnimationClip"]
assert clip["m_SampleRate"] == rate
assert abs(clip["m_AnimationClipSettings"]["m_StopTime"] - (frames - 1) / rate) < 1e-4, clip["m_AnimationClipSettings"]
unity = {curve["attribute"]: curve for curve in clip["m_FloatCurves"]}
assert len(unity) == 52 and all(curve["classID"] == 137 for curve in unity.values()), "SkinnedMeshRenderer"
for name in names:
    keys = [(key["time"] * rate, key["value"] / 100) for key in unity["blendShape." + name]["curve"]["m_Curve"]]
    near(between(keys), column(name), 1.2e-3, "Unity " + name)
godot = text("tres")
assert godot.startswith("[gd_resource type=\"Animation\" format=3")
assert abs(float(re.search(r"^length = ([\d.]+)$", godot, re.M).group(1)) - (frames - 1) / rate) < 1e-4
for track, name in re.findall(r"^tracks/(\d+)/path = NodePath\(\"Face:(\w+)\"\)$", godot, re.M):
    assert f'tracks/{track}/type = "blend_shape"' in godot
    packed = re.search(rf"^tracks/{track}/keys = PackedFloat32Array\((.*)\)$", godot, re.M).group(1)
    flat = [float(value) for value in packed.split(",")]  # time, transition, value
    near(between([(flat[i] * rate, flat[i + 2]) for i in range(0, len(flat), 3)]), column(name), 1.2e-3, "Godot " + name)
maya = text("maya.anim")
assert "\ntimeUnit sec;\n" in maya
for name, body in re.findall(r"^anim (\w+) \w+ blendShape1 0 0 \d+;\nanimData \{(.*?)^\}", maya, re.M | re.S):
    keys = [(float(time) * rate, float(value)) for time, value in (line.split()[:2] for line in body.split("keys {")[1].split("}")[0].strip().splitlines())]
    near(between(keys), column(name), 1.2e-3, "Maya " + name)
assert len(re.findall(r"^anim ", maya, re.M)) == 52

# Visemes: a row adds up to 1.
visemes = list(csv.DictReader(open(path("visemes.csv"), encoding="utf-8")))
assert len(visemes) == frames and len(visemes[0]) == 16
assert all(abs(sum(float(v) for k, v in row.items() if k != "time_s") - 1) < 1e-4 for row in visemes)
assert json.loads(text("visemes.json"))["names"] == list(visemes[0])[1:]

# Markers: CSV against TRC (OpenSim's description of the format) and C3D (the C3D User Guide), read here by their offsets.
table = list(csv.reader(open(path("csv"), encoding="utf-8")))
markers = [cell[:-2] for cell in table[0][1::3]]
motion = [[float(cell) for cell in row[1:]] for row in table[1:]]
trc = [line.split("\t") for line in text("trc").splitlines()]
head = dict(zip(trc[1], trc[2]))
assert (float(head["DataRate"]), int(head["NumFrames"]), int(head["NumMarkers"]), head["Units"]) == (rate, frames, len(markers), "mm")
assert [cell for cell in trc[3][2:] if cell] == markers and trc[4][2:5] == ["X1", "Y1", "Z1"]
body = [line for line in trc[5:] if len(line) > 2]
assert [int(line[0]) for line in body] == list(range(1, frames + 1))
for line, row in zip(body, motion):
    near([float(cell) for cell in line[2:] if cell], row, 1e-3, "TRC")
c3d = (folder / "line.c3d").read_bytes()
parameters = 512 * (c3d[0] - 1)
assert c3d[1] == 0x50 and c3d[parameters + 3] == 84, "Intel's numbers"
points, _, first, last, _, scale, data, _, c3d_rate = struct.unpack_from("<HHHHHfHHf", c3d, 2)
assert (points, last - first + 1, c3d_rate) == (len(markers), frames, rate) and scale < 0, "floats"
groups, at = {}, parameters + 4
while c3d[at]:
    length, number = struct.unpack_from("<bb", c3d, at)
    name = c3d[at + 2:at + 2 + abs(length)].decode()
    skip_by = struct.unpack_from("<h", c3d, at + 2 + abs(length))[0]
    value = at + 4 + abs(length)
    groups[name if number < 0 else (number, name)] = -number if number < 0 else value
    at = at + 2 + abs(length) + skip_by
    if not skip_by:
        break
label_at = groups[(groups["POINT"], "LABELS")]
kind, dimensions, wide, count = struct.unpack_from("<bBBB", c3d, label_at)
assert (kind, dimensions) == (-1, 2)
assert [c3d[label_at + 4 + wide * i:label_at + 4 + wide * (i + 1)].decode().strip() for i in range(count)] == markers
for frame, row in enumerate(motion):
    at = 512 * (data - 1) + 16 * points * frame
    values = struct.unpack_from(f"<{4 * points}f", c3d, at)
    near([values[4 * i + axis] for i in range(points) for axis in range(3)], row, 1e-3, "C3D")
print(f"{frames} frames, {len(markers)} markers, {len(ends)} phones, {len(cues)} mouths: all files tell the same")
