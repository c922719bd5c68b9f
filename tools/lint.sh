#!/bin/sh
# Formatting, then clang-tidy with the naming rules of .clang-tidy over every source of the libraries and programs.
set -eu
git ls-files '*.h' '*.cpp' | xargs clang-format --dry-run --Werror
cmake --preset dev -DCMAKE_CXX_COMPILER=clang++ -B build-lint >/dev/null
cmake --build build-lint --target generated_sources >/dev/null 2>&1 || true
git ls-files 'src/*.cpp' 'deform/*.cpp' 'retarget/*.cpp' 'corpus_tools/*.cpp' |
  xargs -P "$(nproc)" -n 4 clang-tidy -p build-lint --quiet --warnings-as-errors='readability-identifier-naming'
