#!/usr/bin/env bash
# Kills a render (SIGKILL) at moments from its start to its end, and looks at what is left: each frame is whole or absent, and the next
# run, with the same kernel cache, draws the frames that an undisturbed one draws. Then two processes draw into one folder.
#
#   scripts/kill.sh [PROGRAM [MOMENTS]]     default: build/release/halfshade, 50
set -euo pipefail
cd "$(dirname "$0")/.."
program=$(realpath "${1:-build/release/halfshade}")
moments=${2:-50}
scene=$PWD/data/scenes/turntable.json
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export POCL_CACHE_DIR=$work/cache

arguments=(render "$scene" --frames 1-4 --resolution 320x320 -m hard)
draw() { "$program" "${arguments[@]}" --quiet -o "$1"; }
fail() {
  echo "kill: $*" >&2
  exit 1
}
# Whether each frame of a folder is that of the undisturbed run: all of it can be read, and nothing differs.
check() {
  local frame
  for frame in "$1"/*.exr; do
    [[ -e $frame ]] || continue
    "$program" compare "$frame" "$work/whole/$(basename "$frame")" --fail-rmse 0 >/dev/null || fail "$2: $frame is not whole"
  done
}

begin=$(date +%s%N)
draw "$work/whole" # kernels are compiled, as in each run below
whole_ns=$(($(date +%s%N) - begin))
for ((i = 0; i < moments; ++i)); do
  rm -rf "$work/cache" "$work/out"
  "$program" "${arguments[@]}" -o "$work/out" >/dev/null 2>&1 &
  victim=$!
  sleep "$(awk "BEGIN { print $whole_ns * 1e-9 * $i / $moments }")"
  kill -KILL "$victim" 2>/dev/null || true
  wait "$victim" 2>/dev/null || true
  check "$work/out" "moment $i"
  draw "$work/out" || fail "moment $i: the next run ends with $?"
  [[ $(find "$work/out" -name '*.exr' | wc -l) == 4 ]] || fail "moment $i: frames are missing"
  check "$work/out" "moment $i, next run"
done

rm -rf "$work/out"
draw "$work/out" &
first=$!
draw "$work/out" || fail "two processes: the second ends with $?"
wait "$first" || fail "two processes: the first ends with $?"
[[ $(find "$work/out" -type f | wc -l) == 4 ]] || fail "two processes: $(ls "$work/out")"
check "$work/out" "two processes"
echo "kill: $moments moments and two processes, all frames whole"
