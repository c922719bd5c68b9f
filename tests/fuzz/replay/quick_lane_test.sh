#!/bin/sh
# Which fuzz targets the quick lane runs for a change: every kind of file that a target is made of selects it.
cd "$(dirname "$0")/../../.." || exit 1
failed=0
expect() {  # FILE READER...
  found=$(CHANGED=$1 tools/quick.sh --list | sed 's/.* - readers //')
  shift
  for reader in "$@"; do
    case " $found " in *" $reader "*) ;; *) echo "$reader is not among what its change selects: $found"; failed=1 ;; esac
  done
}
expect src/base/json_fields.cpp corpus mesh song packed_musicxml times
expect tests/fuzz/c3d_mutator.cpp c3d
expect tests/fuzz/glb_mutator.cpp mesh glb_growth
expect tests/fuzz/mutator.h c3d mesh glb_growth
expect tests/fuzz/dictionaries/times.dict times
expect tests/fuzz/corpora/song/twinkle song
expect tests/fuzz/c3d_fuzz.cpp c3d
expect src/programs/synth/stream_input.cpp stream_input
expect src/singing/song.cpp song midi
[ "$(CHANGED=README.md tools/quick.sh --list | sed 's/.* - readers //')" = none ] || { echo "README.md selects readers"; failed=1; }
exit $failed
