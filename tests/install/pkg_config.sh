#!/bin/sh
# pkg_config.sh PREFIX LIBDIR EXAMPLES SCRATCH FLAGS: builds one example by pkg-config, shared and static, and runs both.
set -eu
export PKG_CONFIG_PATH="$1/$2/pkgconfig"
# shellcheck disable=SC2046,SC2086
c++ -std=c++20 $5 "$3/speak_a_line.cpp" -o "$4/by_pkg_config" $(pkg-config --cflags --libs mouthpiece)
LD_LIBRARY_PATH="$1/$2" "$4/by_pkg_config" "now" "$4/by_pkg_config.glb"
# shellcheck disable=SC2046,SC2086
c++ -std=c++20 $5 "$3/speak_a_line.cpp" -o "$4/by_pkg_config_static" $(pkg-config --cflags mouthpiece) \
  "$1/$2/libmouthpiece.a" $(pkg-config --static --libs-only-l --libs-only-other mouthpiece | sed 's/-lmouthpiece//')
MOUTHPIECE_SHARE="$1/share/mouthpiece" "$4/by_pkg_config_static" "now" "$4/by_pkg_config_static.glb"
