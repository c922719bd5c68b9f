#!/usr/bin/python3
"""What Mouthpiece is made of, as SPDX 2.3 JSON: Debian's packages of tools/setup.sh and those of all libraries that the
built programs and the shared library link or load, with their versions here and licences (from
/usr/share/doc/PACKAGE/copyright), npm's of viewer/package-lock.json, and those of which tools/fetch_packed.sh brings files.

    sbom.py --out build/mouthpiece.spdx.json [--build build]

The same machine and commit give the same bytes. A licence that SPDX has no name for stands under Debian's, as a
LicenseRef; a package whose copyright file is no machine-readable one has what was read there by hand, else NOASSERTION,
and is named on stderr then.
"""
import argparse
import datetime
import json
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
SPDX_OF_DEBIAN = {
    "expat": "MIT", "mit": "MIT", "apache-2.0": "Apache-2.0", "bsd-2-clause": "BSD-2-Clause", "bsd-3-clause": "BSD-3-Clause",
    "bsd-4-clause": "BSD-4-Clause", "isc": "ISC", "zlib": "Zlib", "openssl": "OpenSSL", "public-domain": "LicenseRef-public-domain",
    "boost-1.0": "BSL-1.0", "bsl-1.0": "BSL-1.0", "mpl-2.0": "MPL-2.0", "mpl-2": "MPL-2.0", "mpl2": "MPL-2.0", "bsd-2": "BSD-2-Clause",
    "bsd-3": "BSD-3-Clause", "bsd-3clause": "BSD-3-Clause", "bsd-4": "BSD-4-Clause", "bsd-4clause": "BSD-4-Clause",
    "apache-2": "Apache-2.0", "bsl-1": "BSL-1.0", "unlicense": "Unlicense", "x11": "X11", "cc-by-4": "CC-BY-4.0",
    "apache 2.0 and mit": "Apache-2.0 AND MIT", "artistic": "Artistic-1.0-Perl", "cc0": "CC0-1.0",
    "cc0-1.0": "CC0-1.0", "unicode": "Unicode-DFS-2016",
}
FURTHER = "LicenseRef-further-terms"  # of some files, without a name in SPDX: they stand in the copyright file
FLITE = ["MIT-Festival", "BSD-2-Clause", "Spencer-86", "GPL-2.0-only", "GPL-3.0-only", FURTHER]
ESPEAK = ["BSD-2-Clause", "GPL-3.0-or-later", FURTHER]
GCC = ["GPL-3.0-or-later WITH GCC-exception-3.1", "LGPL-2.1-or-later", FURTHER]
# What stands in copyright files that no machine can read.
READ_BY_HAND = {
    "build-essential": ["GPL-2.0-or-later"], "festival": ["MIT-Festival"], "festvox-kallpc16k": ["MIT-Festival"],
    "flite1-dev": FLITE, "libflite1": FLITE, "espeak-ng-data": ESPEAK, "libespeak-ng-dev": ESPEAK, "libespeak-ng1": ESPEAK,
    "libc6": ["LGPL-2.1-or-later", "GPL-2.0-or-later", FURTHER], "libgcc-s1": GCC, "libstdc++6": GCC,
    "libcgal-dev": ["GPL-3.0-or-later", "LGPL-3.0-or-later", "BSL-1.0", "BSD-3-Clause", "MIT"], "python3": ["Python-2.0"],
}


def spdx_of(debian):
    """An SPDX identifier for Debian's short name of a licence."""
    name = debian.lower().rstrip(".")
    if name in SPDX_OF_DEBIAN:
        return SPDX_OF_DEBIAN[name]
    family = re.fullmatch(r"(a?gpl|lgpl|gfdl)-?(\d)(?:\.(\d))?(?:\.0)?(\+?)", name)
    if family:
        kind, major, minor, later = family.groups()
        return f"{kind.upper()}-{major}.{minor or 0}-{'or-later' if later else 'only'}"
    return "LicenseRef-" + re.sub(r"[^A-Za-z0-9.-]+", "-", debian).strip("-")


def debian_licences(package):
    """Sorted SPDX expressions of a package's copyright file; empty when it is no machine-readable one."""
    file = pathlib.Path("/usr/share/doc") / package / "copyright"
    text = file.read_text(errors="replace") if file.exists() else ""
    if "Format:" not in text[:2000]:
        return []
    found = set()
    for line in re.findall(r"^License:[ \t]*(\S.*)$", text, re.M):
        for part in re.split(r"\s*,?\s+(?:and|or)\s+|\s*\|\s*|,\s*", line):
            part = re.sub(r"\s+with\s+.*", "", part.strip())
            if re.fullmatch(r"[A-Za-z0-9.+/_-]+", part):
                found.add(spdx_of(part))
    return sorted(found)


def linked_libraries(build):
    """Files of all libraries that the built programs and the shared library link, and that they load when they want them."""
    files = set()
    for binary in [build / "bin" / name for name in ("synth", "corpus", "retarget")] + sorted(build.glob("libmouthpiece.so")):
        if binary.exists():
            told = subprocess.run(["ldd", binary], capture_output=True, text=True).stdout
            files.update(re.findall(r"(/\S+) \(0x", told))
    known = subprocess.run(["/sbin/ldconfig", "-p"], capture_output=True, text=True).stdout
    for source in (ROOT / "src").rglob("*.[ch]*"):
        for name in re.findall(r'"(lib[\w+-]+\.so\.\d+)"', source.read_text()):
            files.update(re.findall(rf"^\t{re.escape(name)} .* => (\S+)$", known, re.M)[:1])
    return sorted(files)


def packages_of(files):
    """The packages that these files came with; dpkg knows a file by the name it was packed under, before /lib was /usr/lib."""
    names = set()
    for file in files:
        real = os.path.realpath(file)
        for name in (real, real.removeprefix("/usr"), file):
            told = subprocess.run(["dpkg-query", "-S", name], capture_output=True, text=True)
            if told.returncode == 0:
                names.add(told.stdout.split(":")[0])
                break
        else:
            print(f"sbom.py: no package has {file}", file=sys.stderr)
    return names


def debian_packages(linked):
    """Those that one builds with and those of `linked` files."""
    names = subprocess.run([ROOT / "tools/setup.sh", "list"], check=True, capture_output=True, text=True).stdout.split()
    linked_names = packages_of(linked)
    query = "${Package}\t${Version}\t${Architecture}\t${db:Status-Status}\n"
    rows = subprocess.run(["dpkg-query", "-W", "-f=" + query] + names + sorted(linked_names), capture_output=True, text=True).stdout
    for row in sorted(set(rows.splitlines())):
        name, version, architecture, status = row.split("\t")
        if status == "installed":
            yield {"name": name, "version": version, "licences": debian_licences(name) or READ_BY_HAND.get(name, []),
                   "from": f"pkg:deb/debian/{name}@{version}?arch={architecture}", "linked": name in linked_names}


def npm_packages():
    lock = json.loads((ROOT / "viewer/package-lock.json").read_text())
    for path, facts in sorted(lock["packages"].items()):
        if path.startswith("node_modules/") and not facts.get("optional"):
            name = path.rpartition("node_modules/")[2]
            yield {"name": name, "version": facts["version"], "licences": [SPDX_OF_DEBIAN.get(facts["license"].strip("()").lower(), facts["license"])] if "license" in facts else [],
                   "from": f"pkg:npm/{name.replace('@', '%40')}@{facts['version']}", "only_tests": facts.get("dev", False)}


def npm_files():
    """Packages of which tools/fetch_packed.sh brings some files."""
    licences = {"mind-ar": ["Apache-2.0"], "@moonshine-ai/moonshine-js": ["MIT"]}
    for file in ("Makefile", "viewer/CMakeLists.txt"):
        for name, version in re.findall(r"fetch_packed\.sh (\S+)@(\d\S*)", (ROOT / file).read_text()):
            yield {"name": name, "version": version, "licences": licences.get(name, []),
                   "from": f"pkg:npm/{name.replace('@', '%40')}@{version}"}


def element_of(package, number):
    # All licences of a package's files: Debian tells which file has which, SPDX here that all apply somewhere in it.
    declared = " AND ".join(f"({l})" if " " in l else l for l in package["licences"]) or "NOASSERTION"
    return {"SPDXID": f"SPDXRef-{number}", "name": package["name"], "versionInfo": package["version"],
            "downloadLocation": "NOASSERTION", "filesAnalyzed": False, "licenseConcluded": "NOASSERTION",
            "licenseDeclared": declared, "copyrightText": "NOASSERTION",
            "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl", "referenceLocator": package["from"]}]}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build", help="where bin/synth is")
    options = parser.parse_args()
    out, linked = options.out, linked_libraries(options.build)
    if not linked:
        print("sbom.py: no programs are built: what they link is left out", file=sys.stderr)

    def git(*words):
        return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True).stdout.strip()

    commit = git("rev-parse", "HEAD") or "unknown"
    seconds = int(os.environ.get("SOURCE_DATE_EPOCH") or git("log", "-1", "--format=%ct") or 0)
    version = re.search(r"project\(Mouthpiece VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text()).group(1)
    packages = list(debian_packages(linked)) + list(npm_packages()) + list(npm_files())
    own = {"SPDXID": "SPDXRef-Mouthpiece", "name": "Mouthpiece", "versionInfo": version, "downloadLocation": "NOASSERTION",
           "filesAnalyzed": False, "licenseConcluded": "GPL-3.0-or-later", "licenseDeclared": "GPL-3.0-or-later",
           "copyrightText": "NOASSERTION"}
    elements = [element_of(package, number) for number, package in enumerate(packages)]
    relations = [{"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES", "relatedSpdxElement": "SPDXRef-Mouthpiece"}]
    for package, element in zip(packages, elements):
        kind = ("TEST_DEPENDENCY_OF" if package.get("only_tests") else
                "RUNTIME_DEPENDENCY_OF" if package.get("linked") else "DEPENDENCY_OF")
        relations.append({"spdxElementId": element["SPDXID"], "relationshipType": kind, "relatedSpdxElement": "SPDXRef-Mouthpiece"})
    names = sorted({name for e in elements for name in re.findall(r"LicenseRef-[A-Za-z0-9.-]+", e["licenseDeclared"])})
    document = {
        "spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": f"Mouthpiece-{version}",
        "documentNamespace": f"https://spdx.invalid/mouthpiece/{version}/{commit}",
        "creationInfo": {"created": datetime.datetime.fromtimestamp(seconds, datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ"),
                         "creators": ["Tool: mouthpiece-tools-sbom.py"]},
        "packages": [own] + elements, "relationships": relations,
        "hasExtractedLicensingInfos": [{"licenseId": name, "extractedText": "See /usr/share/doc/PACKAGE/copyright of the "
                                        f"packages that name it; Debian calls it {name[len('LicenseRef-'):]}."} for name in names],
    }
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(json.dumps(document, indent=1, sort_keys=True) + "\n")
    unknown = [package["name"] for package in packages if not package["licences"]]
    print(f"{out}: {len(packages)} packages, {sum(package.get('linked', False) for package in packages)} of them linked, "
          f"{len(unknown)} without a known licence")
    if unknown:
        print("sbom.py: no known licence: " + " ".join(unknown), file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
