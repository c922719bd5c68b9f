#!/bin/sh
# Installs what Mouthpiece needs on Debian 12: `tools/setup.sh` for `make build` and `make demo`,
# `tools/setup.sh test` for what only the tests need besides; bench, lint, nightly, processors (cross compilers), wasm and portable
# are for what their verbs do. Asks the network only for what is missing.
set -eu

build_packages="build-essential cmake ninja-build pkg-config ca-certificates \
  libeigen3-dev libfmt-dev nlohmann-json3-dev libcli11-dev libssl-dev libsqlite3-dev \
  libopenmesh-dev libcgal-dev libboost-dev libhwy-dev libtinygltf-dev libmeshoptimizer-dev libdraco-dev libsndfile1-dev libflac-dev libdeflate-dev zlib1g-dev libaubio-dev libfftw3-dev libpugixml-dev libcpp-httplib-dev \
  libpocketsphinx-dev pocketsphinx-en-us flite1-dev libespeak-ng-dev espeak-ng-data libicu-dev festival festvox-us-slt-hts festvox-kallpc16k \
  libxnnpack-dev libpthreadpool-dev ffmpeg python3"
test_packages="libgtest-dev libtinyobjloader-dev locales chromium blender python3-numpy python3-yaml praat slurm-wlm munge debootstrap mecab open-jtalk-mecab-naist-jdic"
bench_packages="libbenchmark-dev"
lint_packages="clang clang-format clang-tidy libclang-rt-dev"
nightly_packages="$test_packages $lint_packages valgrind gcovr"
processor_packages="g++-s390x-linux-gnu g++-arm-linux-gnueabihf g++-aarch64-linux-gnu qemu-user-static"
wasm_packages="emscripten"
portable_packages="clang libc++-dev libc++abi-dev googletest"

packages=$build_packages
for group in "$@"; do
  case $group in
    test) packages="$packages $test_packages" ;;
    bench) packages="$packages $bench_packages" ;;
    lint) packages="$packages $lint_packages" ;;
    nightly) packages="$packages $nightly_packages" ;;
    processors) packages="$packages $processor_packages" ;;
    wasm) packages="$packages $wasm_packages" ;;
    portable) packages="$packages $portable_packages" ;;
    list) echo "$packages"; exit 0 ;;  # for tools/sbom.py
    *) echo "setup.sh: unknown group '$group'; expected test, bench, lint, nightly, processors, wasm or portable" >&2; exit 2 ;;
  esac
done

# The page is bundled with Node; a Node 18 or later that is already here will do.
node_is_recent() {
  command -v node >/dev/null 2>&1 && command -v npm >/dev/null 2>&1 &&
    [ "$(node -p 'process.versions.node.split(".")[0]' 2>/dev/null || echo 0)" -ge 18 ]
}
node_is_recent || packages="$packages nodejs npm"

missing=""
for package in $packages; do
  [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing="$missing $package"
done
[ -z "$missing" ] && exit 0

if [ "$(id -u)" -eq 0 ]; then as_root=""
elif command -v sudo >/dev/null 2>&1; then as_root="sudo"
else
  echo "setup: these packages are missing and there is no sudo here; as root run: apt-get install$missing" >&2
  exit 1
fi
echo "setup: installing$missing"
export DEBIAN_FRONTEND=noninteractive
install_missing() {  # waits for another apt, as machines start one by themselves
  # shellcheck disable=SC2086
  $as_root env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=600 install -y -q --no-install-recommends $missing >"$log" 2>&1
}
log=$(mktemp)
trap 'rm -f "$log"' EXIT
$as_root apt-get update -q >"$log" 2>&1 && install_missing || {
  tail -n 5 "$log" >&2
  echo "setup: apt-get could not install all packages; try by hand: apt-get install$missing" >&2
  exit 1
}
