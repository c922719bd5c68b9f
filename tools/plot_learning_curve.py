#!/usr/bin/env python3
"""Draws `corpus evaluate X.corpus --learning-curve 10,25,... --json` as an SVG: error, correlations and closures
against the number of takes, with 95 % intervals.

    corpus evaluate s1.corpus --learning-curve 10,25,50,100,200 --json > curve.json
    tools/plot_learning_curve.py curve.json docs/pictures/learning_curve.svg
"""
import json
import math
import sys

PANELS = [
    ("lip_rms_mm", "lip RMS, mm", 1),
    ("opening_correlation", "r opening", 1),
    ("width_correlation", "r width", 1),
    ("closure_recall", "closures kept, %", 100),
    ("false_closure_share", "false closures, %", 100),
    ("variance_ratio", "variance ratio", 1),
    ("jerk_ratio", "jerk ratio", 1),
    ("lve_mm2", "LVE, mm²", 1),
]
COLOURS = {"greedy": "#c0392b", "guided": "#1f6feb"}
WIDTH, HEIGHT, GAP, COLUMNS = 210, 150, 50, 4


def read_curve(path):
    """{method: [(takes, row), ...]}"""
    curves = {}
    for row in json.load(open(path, encoding="utf-8"))["rows"]:
        takes, method = row["method"].split(":")
        curves.setdefault(method.strip(), []).append((int(takes), row))
    return curves


def panel(curves, key, title, factor, left, top):
    """One measure: a line a method, a bar for each interval."""
    points = {
        method: [(takes, factor * row[key], [factor * end for end in row["intervals"][key]])
                 for takes, row in rows if row[key] is not None and None not in row["intervals"][key]]
        for method, rows in curves.items()
    }
    every = [point for line in points.values() for point in line]
    low, high = min(p[2][0] for p in every), max(p[2][1] for p in every)
    margin = 0.08 * (high - low) or 0.1
    low, high = low - margin, high + margin
    sizes = sorted({p[0] for p in every})

    def x(takes):
        return left + WIDTH * (0.06 + 0.88 * math.log(takes / sizes[0]) / max(math.log(sizes[-1] / sizes[0]), 1e-9))

    def y(value):
        return top + HEIGHT * (high - value) / (high - low)

    svg = [f'<rect x="{left}" y="{top}" width="{WIDTH}" height="{HEIGHT}" fill="none" stroke="#c8ccd4"/>',
           f'<text x="{left}" y="{top - 8}" font-weight="600">{title}</text>']
    for i in range(4):
        value = low + margin + (high - low - 2 * margin) * i / 3
        digits = 0 if high - low > 10 else 1 if high - low > 2 else 2
        svg.append(f'<line x1="{left}" x2="{left + WIDTH}" y1="{y(value):.1f}" y2="{y(value):.1f}" stroke="#eceef2"/>'
                   f'<text x="{left - 5}" y="{y(value) + 4:.1f}" text-anchor="end">{value:.{digits}f}</text>')
    svg += [f'<text x="{x(size):.1f}" y="{top + HEIGHT + 14}" text-anchor="middle">{size}</text>' for size in sizes]
    for shift, (method, line) in enumerate(points.items()):
        colour = COLOURS.get(method, "#555")
        at = [(x(takes) + 3 * shift, y(value), [y(end) for end in ends]) for takes, value, ends in line]
        svg.append('<polyline fill="none" stroke-width="2" stroke="%s" points="%s"/>' %
                   (colour, " ".join(f"{px:.1f},{py:.1f}" for px, py, _ in at)))
        for px, py, ends in at:
            svg.append(f'<line x1="{px:.1f}" x2="{px:.1f}" y1="{ends[0]:.1f}" y2="{ends[1]:.1f}" stroke="{colour}" '
                       f'stroke-opacity="0.5"/><circle cx="{px:.1f}" cy="{py:.1f}" r="3" fill="{colour}"/>')
    return "\n".join(svg)


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    curves = read_curve(sys.argv[1])
    rows = math.ceil(len(PANELS) / COLUMNS)
    width, height = COLUMNS * (WIDTH + GAP) + GAP, rows * (HEIGHT + GAP) + 70
    svg = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
           'font-family="system-ui, sans-serif" font-size="12" fill="#1c2430">',
           f'<rect width="{width}" height="{height}" fill="#fff"/>']
    for i, method in enumerate(curves):
        svg.append(f'<circle cx="{GAP + 90 * i}" cy="20" r="5" fill="{COLOURS.get(method, "#555")}"/>'
                   f'<text x="{GAP + 10 + 90 * i}" y="24">{method}</text>')
    for i, (key, title, factor) in enumerate(PANELS):
        left, top = GAP + (i % COLUMNS) * (WIDTH + GAP), 60 + (i // COLUMNS) * (HEIGHT + GAP)
        svg.append(panel(curves, key, title, factor, left, top))
    svg.append(f'<text x="{width / 2}" y="{height - 8}" text-anchor="middle">takes in the corpus; bars: 95 % interval '
               'over the held-out takes</text></svg>')
    with open(sys.argv[2], "w", encoding="utf-8") as out:
        out.write("\n".join(svg) + "\n")


main()
