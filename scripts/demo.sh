#!/usr/bin/env bash
# From a fresh clone to pictures and figures: packages, optimised build, the scene of primitives with every method, and a page with
# the speed and error of each against ray tracing.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/setup.sh
cmake --preset release >/dev/null
cmake --build --preset release --target halfshade_cli
build/release/halfshade render data/scenes/primitives.json --method all --png -o out/demo

echo "The frames, as EXR with every channel and as PNG to look at:"
ls -1 "$PWD"/out/demo/primitives.*

build/release/halfshade report data/scenes/primitives.json --quick -o out/demo/report
