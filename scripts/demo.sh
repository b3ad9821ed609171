#!/usr/bin/env bash
# From a fresh clone to pictures: packages, optimised build, the scene of primitives with every method.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/setup.sh
cmake --preset release >/dev/null
cmake --build --preset release --target halfshade_cli
build/release/halfshade render data/scenes/primitives.json --method all --png -o out/demo

echo "The frames, as EXR with every channel and as PNG to look at:"
ls -1 "$PWD"/out/demo/primitives.*
