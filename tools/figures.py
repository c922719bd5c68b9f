#!/usr/bin/env python3
"""The house's figures, of the files that git tracks: headers, casts, lines, tests a line.

    tools/figures.py [--root DIR] [--headers]

`--headers` also names the headers that one file alone includes. A header's own source (same folder, same stem) and the
tests do not count as includers; those of include/ are there for others and are not looked at. The lines of tests/unit/WING count for the wing of that name, those of tests/property
for units as well, those of tests/golden for programs as well.
"""
import argparse
import collections
import pathlib
import re
import subprocess

TOPS = ("src", "deform", "retarget", "corpus_tools", "include")
ALSO_TESTS = {"units": ["tests/property"], "programs": ["tests/golden"]}
INCLUDE = re.compile(r'^\s*#\s*include\s*["<]([^">]+)[">]', re.MULTILINE)


def tracked(root):
    names = subprocess.run(["git", "-C", root, "ls-files", "-z"], capture_output=True, check=True).stdout.split(b"\0")
    paths = (pathlib.PurePosixPath(name.decode()) for name in names if name)
    return [path for path in paths if path.suffix in (".h", ".cpp") and (root / path).exists()]


def wing(path):
    return path.parts[1] if path.parts[0] == "src" else path.parts[0]


def includers_of(headers, texts):
    """For each header the sources that include it by its path from the root, from src or include, or beside them."""
    named = {str(header): header for header in headers}
    for top in ("src", "include"):
        named.update({str(header.relative_to(top)): header for header in headers if header.parts[0] == top})
    found = collections.defaultdict(set)
    for path, text in texts.items():
        for name in INCLUDE.findall(text):
            header = named.get(name) or named.get(str(path.parent / name))
            if header and header != path and (header.parent, header.stem) != (path.parent, path.stem):
                found[header].add(path)
    return found


def lines(texts):
    return sum(text.count("\n") for text in texts)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parents[1])
    parser.add_argument("--headers", action="store_true", help="name the headers with one includer")
    arguments = parser.parse_args()
    root = arguments.root
    texts = {path: (root / path).read_text(encoding="utf-8") for path in tracked(root)}
    sources = {path: text for path, text in texts.items() if path.parts[0] in TOPS}
    tests = {path: text for path, text in texts.items() if path.parts[0] == "tests"}
    headers = [path for path in sources if path.suffix == ".h"]
    includers = includers_of(headers, sources)
    lonely = [header for header in headers if header.parts[0] != "include" and len(includers[header]) == 1]
    source_lines, test_lines = lines(sources.values()), lines(tests.values())
    casts = sum(text.count("static_cast") for text in sources.values())
    print(f"public headers in include/            {sum(path.parts[0] == 'include' for path in headers):6}")
    print(f"headers                               {len(headers):6}")
    print(f"  with one includer but their source  {len(lonely):6}")
    print(f"static_cast in 1,000 lines            {1000 * casts / source_lines:6.1f}")
    print(f"source lines                          {source_lines:6,}")
    print(f"test lines                            {test_lines:6,}")
    print(f"test lines a source line              {test_lines / source_lines:6.2f}")
    print(f"\n{'wing':14} {'lines':>7} {'tests':>7} {'a line':>7} {'casts/1000':>11} {'headers':>8} {'with one':>9}")
    for name in sorted({wing(path) for path in sources}):
        own = {path: text for path, text in sources.items() if wing(path) == name}
        folders = [f"tests/unit/{name}"] + ALSO_TESTS.get(name, [])
        own_tests = lines(text for path, text in tests.items() if any(path.is_relative_to(f) for f in folders))
        own_casts = sum(text.count("static_cast") for text in own.values())
        count = lines(own.values())
        print(f"{name:14} {count:7,} {own_tests:7,} {own_tests / count:7.2f} {1000 * own_casts / count:11.1f} "
              f"{sum(path.suffix == '.h' for path in own):8} {sum(wing(path) == name for path in lonely):9}")
    if arguments.headers:
        print()
        for header in sorted(lonely):
            print(f"{header}  <-  {next(iter(includers[header]))}")


if __name__ == "__main__":
    main()
