#!/bin/sh
# exported_symbols.sh LIBRARY LIST: the C symbols are exactly those of LIST, the C++ ones those of include/mouthpiece.
set -eu
exported=$(nm -D --defined-only --no-demangle "$1" | awk '{print $3}' | sed 's/@.*//')
c=$(printf "%s\n" "$exported" | grep -v '^_' | sort)
if [ "$c" != "$(sort "$2")" ]; then
  echo "the library exports other C symbols than $2 lists:"
  echo "$c" | diff - "$2" || true
  exit 1
fi
others=$(nm -D -C --defined-only "$1" | cut -d' ' -f3- | grep -v '^mouthpiece_' |
  grep -Ev '^(typeinfo (name )?for |vtable for )?mouthpiece::(Speaker|Performance|FrameStream|LiveStream|SharedCorpus|SharedFace|Line|InputError|InternalError|save|formats|formatOf|usualFiles|voiceNames|arkitName|liveLinkPacket|version)' || true)
if [ -n "$others" ]; then
  echo "the library exports what no public header names:"
  echo "$others" | head -20
  exit 1
fi
