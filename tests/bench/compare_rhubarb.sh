#!/bin/sh
# Hearing a recording's phones against Rhubarb Lip Sync's phonetic recogniser, one after the other on one core:
#   tests/bench/compare_rhubarb.sh build/bin/synth a.wav b.wav ...
# Prints the processor time of each over the sound's length. Rhubarb is no Debian package: it is compared when
# `rhubarb` is on the PATH.
set -eu
[ $# -ge 2 ] || { echo "usage: compare_rhubarb.sh SYNTH SOUND..." >&2; exit 2; }
synth=$1; shift
seconds() { # of a WAV, by its header: bytes of sound over bytes a second
  /usr/bin/python3 -c 'import sys, wave; w = wave.open(sys.argv[1]); print(w.getnframes() / w.getframerate())' "$1"
}
cpu() { # of a command, user and system
  /usr/bin/python3 -c '
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(used.ru_utime + used.ru_stime)' taskset -c 0 "$@"
}
folder=$(mktemp -d); trap 'rm -rf "$folder"' EXIT
total=0; ours_phones=0; ours_auto=0; theirs=0
for sound in "$@"; do
  total=$(echo "$total + $(seconds "$sound")" | bc -l)
  ours_phones=$(echo "$ours_phones + $(cpu "$synth" --audio "$sound" --hear phones --quiet -o "$folder/a.TextGrid")" | bc -l)
  ours_auto=$(echo "$ours_auto + $(cpu "$synth" --audio "$sound" --quiet -o "$folder/b.TextGrid")" | bc -l)
  if command -v rhubarb >/dev/null 2>&1; then
    theirs=$(echo "$theirs + $(cpu rhubarb -r phonetic --threads 1 -f tsv -o "$folder/c.tsv" "$sound")" | bc -l)
  fi
done
printf 'synth --hear phones, motion and all: %.3f x real time\n' "$(echo "$ours_phones / $total" | bc -l)"
printf 'synth --hear auto, motion and all:   %.3f x real time\n' "$(echo "$ours_auto / $total" | bc -l)"
if command -v rhubarb >/dev/null 2>&1; then
  printf 'rhubarb -r phonetic:                 %.3f x real time\n' "$(echo "$theirs / $total" | bc -l)"
else
  echo 'rhubarb is not on the PATH: not compared'
fi
