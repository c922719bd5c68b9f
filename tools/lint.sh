#!/bin/sh
# Formatting, then the names (.clang-tidy) in all sources of the libraries and programs, a room's at once.
set -eu
git ls-files '*.h' '*.cpp' | xargs clang-format --dry-run --Werror
rooms='(src|deform|retarget|corpus_tools)/'
cmake --preset dev -DCMAKE_CXX_COMPILER=clang++ -DMOUTHPIECE_UNITY=ON -DMOUTHPIECE_WERROR=OFF -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON -B build-lint >/dev/null
# Texts and tables that a build turns into sources have no names of ours: they may be empty.
ninja -C build-lint -t targets all | sed -nE "s#^($rooms.*/k[A-Za-z0-9]+\.cpp): CUSTOM_COMMAND\$#build-lint/\1#p" | xargs touch
sed -n 's/^ *"file": "\(.*\)".*$/\1/p' build-lint/compile_commands.json | grep -E "/$rooms" | grep -v /tests/ | sort -u |
  xargs -P "$(nproc)" -n 3 clang-tidy -p build-lint --quiet --checks='-*,readability-identifier-naming' \
    --warnings-as-errors='readability-identifier-naming' --header-filter="/$rooms.*\.(h|cpp)\$" 2>/dev/null
