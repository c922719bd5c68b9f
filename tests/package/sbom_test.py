#!/usr/bin/python3
"""The bill of materials names the package of every library that a program asks the loader for, and every licence.

    sbom_test.py BUILD
"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]


def main():
    build = pathlib.Path(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "bill.json"
        subprocess.run([ROOT / "tools/sbom.py", "--out", out, "--build", build], check=True)
        packages = {package["name"]: package for package in json.loads(out.read_text())["packages"]}
    wrong = [f"{name} has no licence" for name, package in packages.items() if package["licenseDeclared"] == "NOASSERTION"]
    asked = 0
    for binary in [build / "bin" / name for name in ("synth", "corpus", "retarget")] + list(build.glob("libmouthpiece.so")):
        told = subprocess.run(["readelf", "-d", binary], check=True, capture_output=True, text=True).stdout
        for library in re.findall(r"\(NEEDED\).*\[(.*)\]", told):
            asked += 1
            owners = subprocess.run(["dpkg-query", "-S", f"*/{library}"], capture_output=True, text=True).stdout
            if not {line.split(":")[0] for line in owners.splitlines()} & packages.keys():
                wrong.append(f"{library}, which {binary.name} links, is in no package that is listed")
    # Those that are loaded when they are wanted.
    wrong += [f"{name} is not listed" for name in ("libflite1", "libpocketsphinx3", "libespeak-ng1") if name not in packages]
    print("\n".join(wrong) or f"{len(packages)} packages, {asked} libraries found in them")
    return 1 if wrong or not asked else 0


if __name__ == "__main__":
    sys.exit(main())
