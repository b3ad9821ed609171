#!/usr/bin/env bash
# Fuzzes what reads files, with clang's libFuzzer and sanitizers: fuzz.sh [seconds of each target, 60 by default]. The corpus grows in
# build/fuzz/corpus; what was found is left in build/fuzz as <target>-crash-*, and makes this fail.
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=${1-60}

cmake -G Ninja -S . -B build/fuzz -D CMAKE_CXX_COMPILER=clang++ -D CMAKE_BUILD_TYPE=RelWithDebInfo -D HALFSHADE_BUILD_FUZZERS=ON \
  -D HALFSHADE_BUILD_TESTS=OFF -D HALFSHADE_BUILD_REPORT=OFF >/dev/null
cmake --build build/fuzz --target halfshade_fuzzers

export ASAN_OPTIONS=detect_leaks=0:allocator_may_return_null=0 UBSAN_OPTIONS=print_stacktrace=1
failed=0
for target in scene obj exr frames; do
  mkdir -p "build/fuzz/corpus/$target"
  "build/fuzz/fuzz_$target" -max_total_time="$seconds" -timeout=20 -rss_limit_mb=3000 -max_len=65536 -print_final_stats=1 \
    -artifact_prefix="build/fuzz/$target-" "build/fuzz/corpus/$target" "tests/fuzz/corpus/$target" 2>"build/fuzz/$target.log" ||
    failed=1
  echo "$target: $(grep -E "stat::number_of_executed_units" "build/fuzz/$target.log" || tail -n 1 "build/fuzz/$target.log")"
done
((failed == 0)) || { echo "fuzz: found something; see build/fuzz/*.log and build/fuzz/*-crash-*" >&2; exit 1; }
