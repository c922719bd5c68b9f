# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds and runs synth and retarget."""
import os
import pathlib
import shutil
import subprocess

HOW_TO_GET = (
    "Mouthpiece is not installed: no program 'synth' on the PATH. Install its Debian package (make deb in its checkout), "
    "or name its folder in the add-on's preferences"
)


class Problem(Exception):
    """What the user is told."""


def find(name, folder=""):
    """The program's path. Raises Problem that says how to get it."""
    places = [pathlib.Path(folder), pathlib.Path(folder) / "bin"] if folder else []
    for place in places:
        if os.access(place / name, os.X_OK):
            return place / name
    found = shutil.which(name)
    if not found:
        raise Problem(HOW_TO_GET)
    return pathlib.Path(found)


def sample_corpus(folder=""):
    """The corpus that comes with the programs."""
    own = find("retarget", folder).resolve()
    shared = os.environ.get("MOUTHPIECE_SHARE")
    places = [pathlib.Path(shared)] if shared else []
    places += [own.parents[1] / "share" / "mouthpiece"]
    for place in places:
        if (place / "sample.corpus").exists():
            return place / "sample.corpus"
    raise Problem(f"{places[-1]} holds no sample.corpus; make it with 'make data' in the checkout, or name a corpus")


def run(name, arguments, folder=""):
    """Runs a program. Raises Problem with what it says."""
    result = subprocess.run(
        [str(find(name, folder)), *map(str, arguments)], capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL
    )
    if result.returncode != 0:
        told = (result.stderr or result.stdout).strip().splitlines()
        raise Problem(told[-1] if told else f"{name} ended with {result.returncode}")
    return result.stdout
