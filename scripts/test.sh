#!/usr/bin/env bash
# From a fresh clone to tested: packages, optimised build, every test.
#
#   --asan      also the tests built by clang with AddressSanitizer and UndefinedBehaviorSanitizer, and a minute of each fuzz target
#   --oclgrind  also a 64x64 frame of every method in Oclgrind, which finds bad memory accesses and data races of kernels
#   --format    first check that the code is formatted
#   --werror    warnings of the optimised build are errors (they always are in the sanitizers' build)
set -euo pipefail
cd "$(dirname "$0")/.."

asan= oclgrind= format= werror=OFF
for argument in "$@"; do
  case $argument in
    --asan) asan=1 ;;
    --oclgrind) oclgrind=1 ;;
    --format) format=1 ;;
    --werror) werror=ON ;;
    *)
      sed -n '2,7s/^# \{0,1\}//p' "$0" >&2
      [[ $argument == --help ]] && exit 0
      exit 2
      ;;
  esac
done

# Builds a preset and runs its tests.
run_tests() {
  local preset=$1
  shift
  cmake --preset "$preset" "$@" >/dev/null
  cmake --build --preset "$preset"
  ctest --preset "$preset" -j "$(nproc)"
}

scripts/setup.sh
scripts/check_docs.sh
if [[ $format ]]; then scripts/format.sh --check; fi
scripts/check_kernels.sh
run_tests release -D HALFSHADE_WERROR=$werror
scripts/readme_tables.py --check
scripts/second_opencl.sh
cmake --build --preset release --target docs >/dev/null
if [[ $asan ]]; then
  run_tests asan
  scripts/fuzz.sh 60 build/asan
  # Leaks are looked for where no device is opened: PoCL's compiler keeps what it made until the process ends, and its threads can
  # bring the leak checker down.
  ASAN_OPTIONS=detect_leaks=1 build/asan/halfshade_tests --gtest_brief=1 \
    --gtest_filter='MakeMesh.*:ObjFile.*:SceneFile*:Topology.*:ImageIo.*:ErrorFigures.*:PixelKinds.*:Comparator.*:ParetoFront.*'
fi
if [[ $oclgrind ]]; then scripts/oclgrind.sh; fi
echo "test: all passed"
