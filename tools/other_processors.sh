#!/bin/sh
# Builds what reads and writes bytes (src/base, src/motion with its formats, and their unit tests) for another processor
# with Debian's cross compiler and runs the tests under qemu: s390x stores numbers the other way round, armhf has 32 bits, arm64 is in many machines.
#   tools/other_processors.sh [s390x|armhf|arm64]...        `tools/setup.sh processors` brings compilers and qemu
# Libraries of the processor are unpacked below build-PROCESSOR and linked from there; nothing of them is installed.
set -eu
cd "$(dirname "$0")/.."
jobs=${JOBS:-$(nproc)}

unpack_libraries() {  # PROCESSOR FOLDER
  [ -e "$2/done" ] && return 0
  mkdir -p "$2/lists/partial" "$2/packages/partial"
  apt="apt-get -qq -o APT::Architecture=$1 -o APT::Architectures=$1 -o Dir::State::Lists=$PWD/$2/lists"
  $apt update || echo "other_processors.sh: not all lists of $1 could be had; trying with the others" >&2
  (cd "$2/packages" && $apt download libgtest-dev libicu-dev libdeflate-dev libssl-dev zlib1g-dev libfmt-dev libfmt9)
  for package in "$2"/packages/*.deb; do dpkg -x "$package" "$2"; done
  touch "$2/done"
}

for processor in "${@:-s390x}"; do
  case $processor in
    s390x) triplet=s390x-linux-gnu emulator=qemu-s390x-static ;;
    armhf) triplet=arm-linux-gnueabihf emulator=qemu-arm-static ;;
    arm64) triplet=aarch64-linux-gnu emulator=qemu-aarch64-static ;;
    *) echo "other_processors.sh: unknown processor '$processor'; expected s390x, armhf or arm64" >&2; exit 2 ;;
  esac
  folder=build-$processor
  root=$folder/root
  mkdir -p "$folder/objects"
  unpack_libraries "$processor" "$root"
  cmake -DSYMBOL=kFace66LayoutJson -DINPUT=sample_data/layouts/face66.json -DOUTPUT="$folder/kFace66LayoutJson.cpp" \
    -P cmake/EmbedFile.cmake
  cmake -DSYMBOL=kArkitMarkersJson -DINPUT=sample_data/arkit/face66_shapes.json -DOUTPUT="$folder/kArkitMarkersJson.cpp" \
    -P cmake/EmbedFile.cmake
  # Header-only libraries are the same for all processors.
  mkdir -p "$folder/include"
  ln -sfn /usr/include/eigen3 "$folder/include/eigen3"
  ln -sfn /usr/include/nlohmann "$folder/include/nlohmann"
  {
    echo "builddir = $folder"
    echo "cxx = $triplet-g++"
    echo "flags = -std=c++20 -O1 -ffp-contract=off -DMOUTHPIECE_SOURCE_DIR=\\\"$PWD\\\" -Wall -Wextra -Iinclude -Isrc -I. -Itests -I$folder/include" \
      "-isystem $folder/include/eigen3 -isystem $root/usr/include -isystem $root/usr/include/$triplet"
    echo 'rule compile'
    echo '  command = $cxx $flags -MD -MF $out.d -c $in -o $out'
    echo '  depfile = $out.d'
    echo 'rule link'
    # Debian has no archive of fmt.
    echo "  command = \$cxx \$in -o \$out -L$root/usr/lib/$triplet -l:libgtest.a -l:libgtest_main.a -l:libicui18n.a -l:libicuuc.a" \
      "-l:libicudata.a -l:libdeflate.a -l:libz.a -l:libcrypto.a -lfmt -lpthread -latomic -ldl"
    objects=
    for source in src/base/*.cpp src/motion/*.cpp src/motion/formats/*.cpp src/motion/cleaning/*.cpp \
      tests/unit/base/*.cpp tests/unit/motion/*.cpp "$folder"/*.cpp; do
      object=$folder/objects/$(echo "$source" | tr / _).o
      echo "build $object: compile $source"
      objects="$objects $object"
    done
    echo "build $folder/unit_tests: link $objects"
  } >"$folder/build.ninja"
  ninja -f "$folder/build.ninja" -k 0 -j "$jobs" --quiet
  echo "== $processor"
  "$emulator" -L "/usr/$triplet" -E "LD_LIBRARY_PATH=$root/usr/lib/$triplet:/usr/$triplet/lib" "$folder/unit_tests" --gtest_brief=1 --gtest_filter="${FILTER:--ChildProcess.*}"  # children are of this machine
done
