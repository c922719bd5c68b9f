#!/usr/bin/python3
"""Breaks a room in one place at a time and asks its tests: a mutant that they do not notice is a place that nothing holds.

    mutate.py src/motion/*.cpp --target unit_motion [--count 100] [--seed 1] [--build build]

Operators: comparisons (< for <=, == for !=), arithmetic (+ for -, * for /, += for -=), a && or || that is decided, numbers
(one more; a fraction by a tenth), true for false, min for max, removed statements. Checks that only our own mistakes reach
(MOUTHPIECE_EXPECT), messages, memory reserved and templates' heads are left out. All mutants of a file are compiled into one
object (tools/mutants.h), which takes the place of its like in the room's archive when a test
executable of the build folder is linked again: a mutant is then chosen by the environment, and costs no more than the tests
that reach it. What does not compile as a mutant is left as it was. The seed draws a sample of --count (0: all). Tests that
fail, crash or take three times as long kill a mutant; survivors are printed as FILE:LINE, what was and what it became, those
that no test reaches with `not run`. Sources are not touched; what is made lies in BUILD/mutants, and is kept.
"""
import argparse
import concurrent.futures
import hashlib
import json
import os
import pathlib
import random
import re
import resource
import shlex
import signal
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
SWAPS = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "+": "-", "-": "+", "*": "/", "/": "*", "+=": "-=", "-=": "+="}
LEFT_OUT = re.compile(r"MOUTHPIECE_EXPECT|static_assert|^\s*(//|#|template|using|namespace|case |enum )|InputError|fmt::|fail\(|refuse\(|\"|operator|requires|'|\.reserve\(")
STATEMENT = re.compile(r"^\s+(?!return\b|throw\b|if\b|for\b|while\b|else\b|delete\b|break\b|continue\b)[\w.\->\[\]():]+( [+\-*/|&]?= .*|\(.*\)|\+\+);$")
FLAGS = ["-w", "-O1", "-UNDEBUG", "-D_GLIBCXX_ASSERTIONS"]  # the libraries' assertions on, as in the preset dev
MOST_IN_A_FILE = 1 << 11  # a file's numbers do not depend on the others
NUMBER = re.compile(r"(?<![\w.:<'])(?<!e-)(\d+\.\d+|\d+)(e-?\d+)?(F?)(?![\w.>'])")

PRELUDE = ROOT / "tools/mutants.h"


class Mutant:
    def __init__(self, file, line, was, becomes):
        self.file, self.line, self.was, self.becomes = file, line, was, becomes

    def __str__(self):
        return f"{self.file}:{self.line}: `{self.was.strip()}` -> `{self.becomes.strip()}`"


def edits_of(code):
    """(start, end, what is compiled with `@` for the mutant's number, what the mutant stands for) of a line's mutants."""
    for found in re.finditer(r" (\S{1,2}) ", code):
        old = found.group(1)
        if old in SWAPS:
            place = f" {old} mutants::Place<@>{{}} {old} "
            yield found.start(), found.end(), place, f" {SWAPS[old]} "
        elif old == "&&":
            yield found.start(), found.end(), " && !mutants::on<@>() && ", " && false && "
        elif old == "||":
            yield found.start(), found.end(), " || mutants::on<@>() || ", " || true || "
    for found in NUMBER.finditer(code):
        value, power, kind = found.groups()
        real = "." in value or power
        other = f"{float(value + (power or '')) * 1.1 + (0 if power else 0.1):.6g}{kind}" if real else str(int(value) + 1)
        if real and not re.search(r"[.e]", other):
            other = other[:len(other) - len(kind)] + ".0" + kind
        yield found.start(), found.end(), f"mutants::value<@>({found.group(0)}, {other})", other
    for found in re.finditer(r"\b(true|false)\b", code):
        other = {"true": "false", "false": "true"}[found.group(0)]
        yield found.start(), found.end(), f"mutants::value<@>({found.group(0)}, {other})", other
    for found in re.finditer(r"std::(min|max)\(", code):
        other = {"min": "max", "max": "min"}[found.group(1)]
        yield found.start(), found.end(), f"mutants::{found.group(1)}<@>(", f"std::{other}("


def mutated(file, number, dropped):
    """The text with all its mutants but those of the lines dropped, and the mutants, numbered from `number`."""
    out, mutants = [], []
    in_constant = False  # of several lines, which the compiler knows
    for at, line in enumerate((ROOT / file).read_text().splitlines(), 1):
        code = line.split("//")[0].rstrip()
        was_in_constant, in_constant = in_constant, bool(
            in_constant or re.match(r"\s*(static |inline )*constexpr [^()]*$", code)) and not code.endswith(";")
        if not code.strip() or was_in_constant or LEFT_OUT.search(line) or at in dropped:
            out.append(line)
            continue
        made, end = "", 0
        edits = sorted(edits_of(code))
        if edits:  # a constant that the compiler knows could not be broken later
            opened = re.match(r"\s*(static )?constexpr (?!auto .*\[)", code)
            made = re.sub("constexpr", "const", code[:opened.end()]) if opened else ""
            end = opened.end() if opened else 0
        known = "made<" if re.match(r"\s*(static )?const(expr)? ", code) else "value<"
        for first, last, text, other in edits:
            if first < end:
                continue
            made += code[end:first] + text.replace("@", str(number + len(mutants))).replace("value<", known)
            mutants.append(Mutant(file, at, code, code[:first] + other + code[last:]))
            end = last
        made += code[end:]
        if STATEMENT.match(code) and code.count("(") == code.count(")"):
            made = f"{{ if (!mutants::on<{number + len(mutants)}>()) {made.strip()} }}"
            mutants.append(Mutant(file, at, code, ";"))
        out.append(made)
    return f'#line 1 "{ROOT / file}"\n' + "\n".join(out) + "\n", mutants


def rooms_of(build, files):
    """(archive, [(command, source)]) of each room that has one of the files; a unity file is taken apart."""
    rooms = {}
    for entry in json.loads((build / "compile_commands.json").read_text()):
        object_file = re.search(r" -o (\S+) ", entry["command"]).group(1)
        room = re.match(r"(.*)/CMakeFiles/(mouthpiece_\w+)\.dir/", object_file)
        if not room:
            continue
        source = pathlib.Path(entry["file"])
        is_unity = "Unity" in source.parts
        held = re.findall(r'#include "(.+)"', source.read_text()) if is_unity and source.exists() else [source]
        held = [pathlib.Path(p).relative_to(ROOT) for p in held if pathlib.Path(p).is_relative_to(ROOT)]
        rooms.setdefault(f"{room.group(1)}/lib{room.group(2)}.a", []).extend((entry["command"], p) for p in held)
    return {archive: held for archive, held in rooms.items() if set(files) & {file for _, file in held}}


def compiled(build, command, file, first, newest_header):
    """The object of a file with its mutants, numbered from `first` (None: without), and the mutants; kept from before where
    nothing changed."""
    made = build / "mutants" / file
    object_file, key_file = made.with_suffix(".o"), made.with_suffix(".key")
    made.parent.mkdir(parents=True, exist_ok=True)
    original = (ROOT / file).read_text()
    words = shlex.split(command)
    words = [*words[:words.index("-o")], *FLAGS, "-iquote", str((ROOT / file).parent), "-include", str(PRELUDE)]
    text = original if first is None else mutated(file, first, set())[0]
    key = [hashlib.sha256(repr((text, words, PRELUDE.read_text())).encode()).hexdigest()]
    kept = json.loads(key_file.read_text()) if key_file.exists() else [None, []]
    is_kept = kept[0] == key[0] and object_file.exists() and object_file.stat().st_mtime > newest_header
    dropped = set(kept[1]) if is_kept else set()
    while True:
        text, mutants = (original, []) if first is None else mutated(file, first, dropped)
        if is_kept:
            return object_file, mutants
        made.write_text(text)
        run = subprocess.run([*words, "-o", object_file, "-c", made], cwd=build, capture_output=True, text=True)
        if run.returncode == 0:
            key_file.write_text(json.dumps([*key, sorted(dropped)]))
            return object_file, mutants
        lines = {int(n) for n in re.findall(re.escape(f"{ROOT / file}") + r":(\d+)", run.stderr)} - dropped
        if not lines or first is None:
            sys.exit(f"mutate.py: {file} does not compile\n{run.stderr[:2000]}")
        dropped |= lines


def compile_all(build, files, jobs):
    """Archives that are replaced, objects, and the mutants by number."""
    rooms = rooms_of(build, files)
    work = sorted((str(file), command) for held in rooms.values() for command, file in held)
    missing = set(map(str, files)) - {file for file, _ in work}
    if missing:
        sys.exit(f"mutate.py: not built in {build}: {', '.join(sorted(missing))}")
    headers = subprocess.run(["git", "ls-files", "*.h"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    newest = max((ROOT / header).stat().st_mtime for header in headers if (ROOT / header).exists())

    def one(numbered):
        i, (file, command) = numbered
        first = i * MOST_IN_A_FILE if pathlib.Path(file) in files else None
        return first, *compiled(build, command, pathlib.Path(file), first, newest)
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        results = list(pool.map(one, enumerate(work)))
    mutants = {first + i: mutant for first, _, found in results for i, mutant in enumerate(found)}
    return list(rooms), [object_file for _, object_file, _ in results], mutants


def linked(build, target, archives, objects):
    commands = subprocess.run(["ninja", "-t", "commands", target], cwd=build, capture_output=True, text=True, check=True)
    link = re.search(r"&& (\S*c\+\+ .*? -o test_bin/\S+ .*?) && ", commands.stdout.splitlines()[-1]).group(1)
    made = build / "mutants" / target
    words = [word for word in shlex.split(link) if word not in archives]
    at = words.index("-o")
    words[at + 1:at + 2] = [str(made), *map(str, objects)]
    subprocess.run(words, cwd=build, check=True)
    return made


class Tests:
    """A test executable: its tests, grouped by name without their parameters, and what each group reaches."""

    def __init__(self, build, program, folder, tests):
        self.program, self.build, self.folder = program, build, folder
        listed = subprocess.run([program, "--gtest_list_tests", "--gtest_filter=" + tests], capture_output=True, text=True, check=True)
        self.groups, suite = [], ""
        for line in listed.stdout.splitlines():
            name = line.split("#")[0].rstrip()
            if line.startswith(" "):
                test = suite + name.strip()
                group = re.sub(r"/[^/]*$", "/*", test) if "/" in name else test
                if group not in self.groups:
                    self.groups.append(group)
            else:
                suite = name
        self.reached = {}

    def run(self, groups, limit, **environment):
        def bounded():
            resource.setrlimit(resource.RLIMIT_CPU, (int(limit) + 1, int(limit) + 2))
            resource.setrlimit(resource.RLIMIT_AS, (6 << 30, 6 << 30))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        words = [self.program, "--gtest_brief=1", "--gtest_fail_fast", "--gtest_filter=" + ":".join(groups)]
        try:
            return subprocess.run(words, cwd=self.folder, env={**os.environ, **environment}, stdout=subprocess.DEVNULL,
                                  stderr=subprocess.DEVNULL, timeout=20 * limit, preexec_fn=bounded).returncode
        except subprocess.TimeoutExpired:
            return "too long"

    def measure(self, pool, longest):
        def one(group):
            told = self.build / "mutants" / f"reached-{os.getpid()}-{self.groups.index(group)}"
            start = time.monotonic()
            code = self.run([group], longest, MUTANTS_REACHED=str(told))
            if code in (-signal.SIGXCPU, -signal.SIGKILL, "too long"):
                return group, None, None
            if code != 0:
                sys.exit(f"mutate.py: {group} fails as it is")
            took = time.monotonic() - start
            marks = told.read_bytes()
            told.unlink()
            return group, took, marks
        for group, took, marks in pool.map(one, list(self.groups)):
            if marks is None:
                self.groups.remove(group)
                print(f"left out {group}, which takes over {longest} s", flush=True)
            else:
                self.reached[group] = (took, marks)

    def judge(self, number):
        """None when no test reaches it, else whether a test notices; "same" when it is no mutant for its types."""
        reach = [group for group in self.groups if self.reached[group][1][number]]
        if not reach:
            return None
        if any(self.reached[group][1][number] == 2 for group in reach):
            return "same"
        limit = 5 + 3 * sum(self.reached[group][0] for group in reach)
        reach.sort(key=lambda group: self.reached[group][0])
        for some in (reach[:4], reach[4:16], reach[16:48], reach[48:]):  # the quickest first
            if some and self.run(some, limit, MUTANT=str(number)) != 0:
                return True
        return False


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=pathlib.Path)
    parser.add_argument("--target", action="append", required=True, help="a test executable; several are run in turn")
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build")
    parser.add_argument("--filter", default="*", help="of the tests, as --gtest_filter has it")
    parser.add_argument("--longest", type=int, default=600, help="processor seconds a test may take; others are left out")
    parser.add_argument("--minutes", type=float, default=1e9, help="no new mutant after that")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args()
    build = options.build.resolve()
    files = [file.resolve().relative_to(ROOT) for file in options.files]
    if subprocess.run(["ninja", "-C", build, *options.target], capture_output=True).returncode != 0:
        sys.exit("mutate.py: does not build as it is")
    started = time.monotonic()
    archives, objects, mutants = compile_all(build, files, options.jobs)
    print(f"{len(mutants)} mutants compiled in {time.monotonic() - started:.0f} s", flush=True)
    programs = []
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for target in options.target:
            folder = build / "tests" / (target.replace("_", "/", 1) if target.startswith("unit_") else target)
            programs.append(Tests(build, linked(build, target, archives, objects), folder if folder.is_dir() else build, options.filter))
            programs[-1].measure(pool, options.longest)
        drawn = random.Random(options.seed).sample(sorted(mutants), len(mutants))
        sample = drawn[:options.count] if options.count else drawn
        judging = time.monotonic()

        def judge(number):
            if time.monotonic() - judging > 60 * options.minutes:
                return "late"
            verdicts = []
            for program in programs:
                verdicts.append(program.judge(number))
                if verdicts[-1] is True or verdicts[-1] == "same":
                    break
            return verdicts[-1] if verdicts[-1] else (False if False in verdicts else None)
        killed, survived, not_run = 0, 0, 0
        for number, verdict in zip(sample, pool.map(judge, sample)):
            if verdict is True:
                killed += 1
            elif verdict is False or verdict is None:
                survived += verdict is False
                not_run += verdict is None
                print("survived" if verdict is False else "not run ", mutants[number], flush=True)
    judged = killed + survived + not_run
    share = 100 * killed / judged if judged else 0
    print(f"{killed} of {judged} killed ({share:.0f} %), {not_run} not run; drawn from {len(mutants)} with seed {options.seed}, "
          f"{time.monotonic() - started:.0f} s")


if __name__ == "__main__":
    main()
