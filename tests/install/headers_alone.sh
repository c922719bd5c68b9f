#!/bin/sh
# headers_alone.sh INCLUDE: every installed header compiles by itself.
set -eu
for header in "$1"/mouthpiece/*.h; do
  name=mouthpiece/$(basename "$header")
  echo "#include <$name>" | c++ -std=c++20 -Wall -Wextra -Werror -Wconversion -Wsign-conversion -fsyntax-only -I "$1" -x c++ -
done
echo "#include <mouthpiece/mouthpiece.h>" | cc -std=c11 -Wall -Wextra -Werror -pedantic -fsyntax-only -I "$1" -x c -
