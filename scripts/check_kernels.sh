#!/usr/bin/env bash
# Compiles each kernel file and each of their headers alone, in both shapes, with clang and without a device; warnings are errors.
# Other folders than kernels/ may be given.
set -euo pipefail
kernels=${1:-$(dirname "$0")/../kernels}

clang=
for candidate in clang clang-15 clang-14; do
  if command -v "$candidate" >/dev/null; then
    clang=$candidate
    break
  fi
done
if [[ ! $clang ]]; then
  echo "check_kernels: expected clang; install it (scripts/setup.sh does)" >&2
  exit 1
fi

failed=
while IFS= read -r -d '' file; do
  for shape in "-DHS_TILE=32 -DHS_LANES=16" "-DHS_TILE=16 -DHS_LANES=1"; do
    # Headers are main files here, with functions that only others call; masks of one lane are combined as those of many are.
    # shellcheck disable=SC2086
    if ! "$clang" -x cl -cl-std=CL1.2 -Xclang -finclude-default-header -target spir64 -fsyntax-only -Wall -Werror \
      -Wno-pragma-once-outside-header -Wno-unused-function -Wno-bitwise-instead-of-logical -I "$kernels" $shape "$file"; then
      echo "check_kernels: $file does not compile alone ($shape)" >&2
      failed=1
    fi
  done
done < <(find "$kernels" \( -name '*.cl' -o -name '*.h' \) -print0 | sort -z)
[[ ! $failed ]]
