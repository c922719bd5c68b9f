#!/usr/bin/python3
"""Runs the commands of a guide as a reader would, one after the other, in a folder of its own.

    run_commands.py --bin build/bin docs/guides/batch.md     the commands of one page
    run_commands.py --bin build/bin --options                the options that all pages name in running text

What a page may hold (CONTRIBUTING.md says it to writers):
  ```sh                     commands, which are run; every other block says what it is (text, csv, cpp ...)
  <!-- before: COMMAND -->  makes what the reader has at hand; run, not shown
  <!-- not run: REASON -->  above a block: counted, not run
  <!-- needs: PATH -->      above a block: run where the checkout has PATH, otherwise counted
  <!-- few: PATH -->        the commands of the page find every fifteenth of the takes in PATH
Exits with 1 when a command fails, 77 (CTest: skipped) when the sample corpus is not made.
"""
import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import textwrap

ROOT = pathlib.Path(__file__).resolve().parents[2]
SKIPPED = 77
LONGEST_BLOCK_S = 420
EVERY = 15
NOTE = re.compile(r"<!--\s*(before|not run|needs|few):\s*(.*?)\s*-->", re.S)
FENCE = re.compile(r"^( *)```(\w*)\n(.*?)^ *```$", re.M | re.S)


class Step:
    """A piece of a page in its order: hidden or shown commands, or a block that is not run."""

    def __init__(self, line, kind, text, note=""):
        self.line, self.kind, self.text, self.note = line, kind, text, note


def steps_of(text):
    """The steps of a page, and what is wrong with how it is written."""
    steps, faults, notes = [], [], []
    pieces = sorted([(m.start(), m) for m in NOTE.finditer(text)] + [(m.start(), m) for m in FENCE.finditer(text)])
    for start, piece in pieces:
        line = text.count("\n", 0, start) + 1
        if piece.re is NOTE:
            if piece[1] in ("before", "few"):
                steps.append(Step(line, "run" if piece[1] == "before" else "few", piece[2]))
            else:
                notes.append((piece.end(), piece[1], piece[2]))
            continue
        if not piece[2]:
            faults.append(f"line {line}: a block that does not say what it is (sh, text, csv, cpp ...)")
        if piece[2] != "sh":
            continue
        above = [n for n in notes if not text[n[0]:start].strip()]
        notes = [n for n in notes if n not in above]
        kind, note = (above[0][1], above[0][2]) if above else ("run", "")
        steps.append(Step(line, kind, piece[3], note))
    faults += [f"a note above no block: {kind}: {note}" for _, kind, note in notes]
    for found in re.finditer(r"^    +(?:build/bin/)?(?:synth|corpus|retarget) .*", FENCE.sub(lambda m: "\n" * m[0].count("\n"), NOTE.sub("", text)), re.M):
        faults.append(f"a command in a block without ```sh: {found[0].strip()}")
    return steps, faults


def link_folder(source, target, thinned):
    """Makes `target` hold what `source` does, by links; of the takes in the folders `thinned` every fifteenth."""
    target.mkdir()
    names = sorted(source.iterdir())
    if source in thinned:
        few = sorted({file.stem for file in names})[::EVERY]
        names = [file for file in names if file.stem in few]
    for file in names:
        if any(folder.is_relative_to(file) for folder in thinned):
            link_folder(file, target / file.name, thinned)
        else:
            (target / file.name).symlink_to(file)


def run_page(page, bin_folder):
    steps, faults = steps_of(page.read_text())
    thinned = [path for step in steps if step.kind == "few" and (path := (ROOT / step.text).resolve()).exists()]
    steps = [step for step in steps if step.kind != "few"]
    ran = left_out = 0
    with tempfile.TemporaryDirectory(prefix="mouthpiece_guide_") as scratch:
        folder = pathlib.Path(scratch) / "checkout"
        folder.mkdir()
        (folder / "build").mkdir()
        for name in ("bin", "share"):
            (folder / "build" / name).symlink_to(bin_folder.parent / name)
        for name in ("sample_data", "examples", "blender"):
            (folder / name).symlink_to(ROOT / name)
        shared = pathlib.Path(scratch) / "shared"
        if thinned:
            link_folder((ROOT.parent / "shared").resolve(), shared, thinned)
        else:
            shared.symlink_to(ROOT.parent / "shared")
        environment = dict(os.environ, PATH=f"{bin_folder}:{ROOT}/tests/guides:{os.environ['PATH']}", HOME=scratch, XDG_CONFIG_HOME=scratch)
        environment.pop("MOUTHPIECE_CONFIG", None)
        for step in steps:
            if step.kind == "not run" or (step.kind == "needs" and not (ROOT / step.note).exists()):
                left_out += 1
                print(f"{page.name}:{step.line}: not run: {'needs ' if step.kind == 'needs' else ''}{step.note}")
                continue
            script = "set -eo pipefail\ntrap 'echo \"the command: $BASH_COMMAND\" >&2' ERR\n" + textwrap.dedent(step.text)
            result = subprocess.run(["bash", "-c", script], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                                    stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=LONGEST_BLOCK_S, check=False)
            ran += 1
            if result.returncode != 0:
                faults.append(f"line {step.line}: exit {result.returncode}\n" + result.stdout.decode(errors="replace")[-2000:])
                break
    for fault in faults:
        print(f"{page.name}: {fault}")
    print(f"{page.name}: {ran} blocks run, {left_out} not")
    return 1 if faults else 0


def options_of(command, bin_folder, known={}):
    """The long options that a command's help names; None where there is no such command."""
    if command not in known:
        program, *rest = command
        result = subprocess.run([str(bin_folder / program), *rest, "--help"], capture_output=True, text=True, check=False)
        known[command] = set(re.findall(r"--[a-z][a-z0-9-]*", result.stdout)) | {"--stream"} if result.returncode == 0 else None
    return known[command]


def check_options(bin_folder):
    """Every option that a page names beside its program, in running text or in a block, is in that program's help."""
    wrong, checked = [], 0
    for page in sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")]):
        text = page.read_text()
        code = re.findall(r"(?<!`)`([^`\n]+)`(?!`)", text) + [l for m in FENCE.finditer(text) if m[2] == "sh" for l in m[3].splitlines()]
        for found in [piece for line in code for piece in re.split(r"\s*(?:&&|[|;])\s*", re.split(r"\s#\s", line)[0])]:
            words = found.split()
            program = words[0].removeprefix("build/bin/") if words else ""
            if program not in ("synth", "corpus", "retarget") or len(words) < 2:
                continue
            command = (program, "stream") if "--stream" in words else (program,)
            if re.fullmatch(r"[a-z]+", words[1]):
                command = (program, words[1])
            options = options_of(command, bin_folder)
            named = [w.split("=")[0] for w in re.sub(r'"[^"]*"', "x", " ".join(words[1:])).split() if re.match(r"--[a-z]", w)]
            checked += len(named)
            if options is None:
                wrong.append(f"{page.relative_to(ROOT)}: no such command: {found}")
            else:
                wrong += [f"{page.relative_to(ROOT)}: no such option {n}: {found}" for n in named if n not in options]
    print("\n".join(wrong))
    print(f"{checked} options looked up")
    return 1 if wrong or checked < 100 else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--options", action="store_true")
    parser.add_argument("page", type=pathlib.Path, nargs="?")
    given = parser.parse_args()
    bin_folder = given.bin.resolve()
    if given.options:
        return check_options(bin_folder)
    if not (bin_folder.parent / "share/mouthpiece/sample.corpus").exists():
        print("skipped: no sample corpus; make it with `make data`")
        return SKIPPED
    return run_page(given.page.resolve(), bin_folder)


if __name__ == "__main__":
    sys.exit(main())
