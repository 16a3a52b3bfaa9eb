#!/usr/bin/env bash
# No warning in what others compile: every header by itself, all class templates in float and in
# double, the libraries. Without exceptions and run-time types, apart from the adapter of
# Ipopt, which needs both.
#
#   warnings.sh JOBS
#
# Nothing is linked. With these warnings g++ takes four minutes for the estimators that clang++ takes
# 40 s for: it gets them as part of the C library, which is built with the same warnings anyway.
set -euo pipefail
cd "$(dirname "$0")/../.."
warnings="-Werror -fsyntax-only -Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Icpp/include"
cpp="-std=c++17 $warnings $(pkg-config --cflags eigen3 | sed 's/-I/-isystem /g')"
core="$cpp -fno-exceptions -fno-rtti"

commands() {  # the longest first
  for scalar in double float; do
    echo "clang++ $core -DSCALAR=$scalar -DESTIMATORS tests/packaging/all_headers.cpp"
    echo "g++ $core -DSCALAR=$scalar tests/packaging/all_headers.cpp"
  done
  for compiler in clang++ g++; do
    echo "$compiler $cpp $(pkg-config --cflags ipopt | sed 's/-I/-isystem /g') cpp/src/ipopt_solver.cpp"
  done
  for compiler in clang gcc; do
    echo "$compiler -std=c99 $warnings -include tensegrity/tensegrity.h -x c /dev/null"
  done
  (cd cpp/include && find tensegrity -name '*.hpp') | while read -r header; do
    case $header in */ipopt_solver.hpp) flags=$cpp ;; *) flags=$core ;; esac
    echo "clang++ $flags -include $header -x c++ /dev/null"
  done
}
commands | xargs -P "${1:-2}" -d '\n' -I{} bash -c '{} || { echo "in: {}" >&2; exit 1; }'
echo "no warnings"
