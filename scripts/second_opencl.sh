#!/usr/bin/env bash
# Draws every method on Mesa's rusticl over llvmpipe as on PoCL, and fails where a picture differs by more than rounding. The device is
# left to choose its kernels' shape. Needs the release build (test.sh makes it).
set -euo pipefail
cd "$(dirname "$0")/.."

program=build/release/halfshade
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export RUSTICL_ENABLE=llvmpipe POCL_CACHE_DIR=$PWD/build/release/pocl_cache
unset HALFSHADE_KERNEL_SHAPE
if ! "$program" devices | grep -q llvmpipe; then
  echo "second_opencl: expected a device llvmpipe; install mesa-opencl-icd (scripts/setup.sh does)" >&2
  exit 1
fi

draw() {
  timeout 600 "$program" render data/scenes/boxes.json --method all --resolution 128x128 --quiet --device "$1" -o "$folder/$1" \
    2>"$folder/messages" || { cat "$folder/messages" >&2; echo "second_opencl: $1 ends with $?" >&2; exit 1; }
}
draw portable # part of PoCL's platform name
draw llvmpipe
for picture in "$folder"/llvmpipe/*.exr; do
  "$program" compare "$picture" "$folder/portable/$(basename "$picture")" --fail-rmse 1e-4 >"$folder/figures" ||
    { cat "$folder/figures" >&2; echo "second_opencl: $(basename "$picture") differs" >&2; exit 1; }
  echo "second_opencl: $(basename "$picture" .0001.exr): $(grep max_error "$folder/figures" | tr -s ' ')"
done
