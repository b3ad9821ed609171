#!/usr/bin/env bash
# Fuzzes what reads files, with clang's libFuzzer and sanitizers, two targets at a time.
#
#   scripts/fuzz.sh [SECONDS [BUILD]]     each target's seconds, 60 by default; a folder where the targets are built,
#                                         by default build/fuzz, where they are built optimised
#
# The corpus grows in build/fuzz/corpus; what was found is left in build/fuzz as <target>-crash-* and the like, and makes this fail.
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=${1-60}
build=${2-}

if [[ ! $build ]]; then
  build=build/fuzz
  cmake -G Ninja -S . -B $build -D CMAKE_CXX_COMPILER=clang++ -D CMAKE_BUILD_TYPE=RelWithDebInfo -D HALFSHADE_BUILD_FUZZERS=ON \
    -D HALFSHADE_BUILD_TESTS=OFF -D HALFSHADE_BUILD_REPORT=OFF >/dev/null
  cmake --build $build --target halfshade_fuzzers
fi

export ASAN_OPTIONS=detect_leaks=0:allocator_may_return_null=0 UBSAN_OPTIONS=print_stacktrace=1
fuzz() {
  mkdir -p "build/fuzz/corpus/$1"
  "$build/fuzz_$1" -max_total_time="$seconds" -timeout=20 -rss_limit_mb=3000 -max_len=65536 -print_final_stats=1 \
    -artifact_prefix="build/fuzz/$1-" "build/fuzz/corpus/$1" "tests/fuzz/corpus/$1" 2>"build/fuzz/$1.log"
}
failed=0
for pair in "scene obj" "exr frames"; do
  for target in $pair; do
    fuzz "$target" &
  done
  wait -n || failed=1
  wait -n || failed=1
done
for target in scene obj exr frames; do
  echo "fuzz: $target: $(grep -E "stat::number_of_executed_units" "build/fuzz/$target.log" || tail -n 1 "build/fuzz/$target.log")"
done
((failed == 0)) || { echo "fuzz: found something; see build/fuzz/*.log and what lies beside them" >&2; exit 1; }
