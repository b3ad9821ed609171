#!/usr/bin/env bash
# The library on four threads with two queues, under ThreadSanitizer. What PoCL does among its own threads is not looked at.
set -euo pipefail
cd "$(dirname "$0")/.."

cmake --preset tsan >/dev/null
cmake --build --preset tsan --target halfshade_thread_tests
export POCL_CACHE_DIR=$PWD/build/tsan/pocl_cache
TSAN_OPTIONS="ignore_noninstrumented_modules=1 halt_on_error=1 ${TSAN_OPTIONS:-}" build/tsan/halfshade_thread_tests
