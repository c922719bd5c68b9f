#!/usr/bin/env python3
"""Writes man pages and shell completions from what the programs say of themselves.

command_docs.py PROGRAM... --out FOLDER: FOLDER/man1/NAME.1, FOLDER/bash/NAME, FOLDER/zsh/_NAME, FOLDER/fish/NAME.fish.
"""
import argparse
import pathlib
import re
import subprocess


def help_of(program, command=None):
    arguments = [str(program)] + ([command] if command else []) + ["--help"]
    return subprocess.run(arguments, check=True, capture_output=True, text=True).stdout


def commands_of(text):
    part = re.split(r"^Subcommands:\n", text, flags=re.M)
    if len(part) < 2:
        return []
    return re.findall(r"^  ([a-z-]+)\s", part[1].split("\n\n")[0], flags=re.M)


def options_of(text):
    """[(names, what)] of the lines of a help."""
    found = []
    for line in text.splitlines():
        match = re.match(r"^  (-[-\w]+(?:,-[-\w]+)*)\s*(.*)$", line)
        if match:
            found.append([match.group(1).split(","), match.group(2).strip()])
        elif found and line.startswith("                ") and not found[-1][1].endswith("."):
            found[-1][1] += " " + line.strip()
    return [(names, what) for names, what in found]


def roff(text):
    lines = []
    for line in text.rstrip().splitlines():
        line = line.replace("\\", "\\e").replace("-", "\\-")
        lines.append("\\&" + line if line.startswith((".", "'")) else line)
    return "\n".join(lines)


def man_page(name, version, texts):
    what = texts[None].splitlines()[0].rstrip(".")
    page = [f'.TH {name.upper()} 1 "" "{version}" "Mouthpiece"', ".SH NAME", f"{name} \\- {roff(what)}", ".SH SYNOPSIS",
            f".B {name}", "[COMMAND] [OPTIONS]", ".SH DESCRIPTION", ".nf", roff(texts[None]), ".fi"]
    for command, text in texts.items():
        if command:
            page += [f'.SH "{name} {command}"', ".nf", roff(text), ".fi"]
    page += [".SH FILES", ".TP", ".I ~/.config/mouthpiece", "Defaults: lines KEY = VALUE below [synth], [corpus] or [retarget].",
             ".SH EXIT STATUS", "0 done; 1 bad input, told in one line on standard error; 2 wrong usage.",
             ".SH SEE ALSO", ", ".join(f"\\fB{other}\\fR(1)" for other in ("synth", "corpus", "retarget") if other != name)]
    return "\n".join(page) + "\n"


def bash(name, texts):
    cases = "\n".join(f"    {command}) words='{' '.join(n for names, _ in options_of(text) for n in names)}' ;;"
                      for command, text in texts.items() if command)
    top = " ".join([n for names, _ in options_of(texts[None]) for n in names] + [c for c in texts if c])
    return f"""# Completions of {name}; made by tools/command_docs.py.
_{name}() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} words='{top}'
  case ${{COMP_WORDS[1]}} in
{cases}
    *) ;;
  esac
  if [[ $word == -* || $COMP_CWORD -eq 1 ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word"; [[ $word == -* ]] || compgen -f -- "$word")
  else
    mapfile -t COMPREPLY < <(compgen -f -- "$word")
  fi
}}
complete -o filenames -F _{name} {name}
"""


def fish(name, texts):
    lines = [f"# Completions of {name}; made by tools/command_docs.py."]
    commands = " ".join(c for c in texts if c)
    quoted = lambda text: "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"
    for command, text in texts.items():
        if command:
            lines.append(f"complete -c {name} -n '__fish_use_subcommand' -a {command} -d {quoted(text.splitlines()[0])}")
        condition = f"__fish_seen_subcommand_from {command}" if command else f"not __fish_seen_subcommand_from {commands}"
        for names, what in options_of(text):
            switches = " ".join(f"-l {n[2:]}" if n.startswith("--") else f"-s {n[1:]}" for n in names)
            lines.append(f"complete -c {name} -n '{condition}' {switches} -d {quoted(what[:100])}")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("programs", nargs="+", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    given = parser.parse_args()
    for program in given.programs:
        texts = {None: help_of(program)}
        for command in commands_of(texts[None]):
            texts[command] = help_of(program, command)
        version = subprocess.run([str(program), "--version"], check=True, capture_output=True, text=True).stdout.split(" (")[0]
        files = {f"man1/{program.name}.1": man_page(program.name, version.strip(), texts),
                 f"bash/{program.name}": bash(program.name, texts),
                 f"zsh/_{program.name}": f"#compdef {program.name}\nautoload -U +X bashcompinit && bashcompinit\n" +
                 bash(program.name, texts),
                 f"fish/{program.name}.fish": fish(program.name, texts)}
        for path, text in files.items():
            (given.out / path).parent.mkdir(parents=True, exist_ok=True)
            (given.out / path).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
