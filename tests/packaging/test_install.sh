#!/usr/bin/env bash
# The installed tree as its users meet it: found by CMake and by pkg-config, moved to another place,
# with every example built against it and run; and the repository inside another project.
#
#   test_install.sh BUILD RECORDING
#
# BUILD: a build directory of the repository with its libraries built. RECORDING: for example 02.
set -euo pipefail
repository=$(cd "$(dirname "$0")/../.." && pwd)
build=$(cd "$1" && pwd)
recording=$(cd "$2" && pwd)
consumers=$repository/tests/packaging
work=$build/test-install
jobs=${JOBS:-$(nproc)}
# -O0: what counts is that it builds; optimising Eigen's expressions takes minutes.
export CFLAGS="-O0 -Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Werror"
export CXXFLAGS=$CFLAGS

fail() { echo "test_install.sh: $*" >&2; exit 1; }
say() { echo "-- $*"; }

# Configures, builds and runs the project in $1 as $2, with further options of CMake.
build_and_run() {
  local source=$1 name=$2; shift 2
  say "$name"
  cmake -S "$source" -B "$work/$name" -G Ninja "$@" > "$work/$name.log" 2>&1 \
    || { cat "$work/$name.log"; fail "$name does not configure"; }
  cmake --build "$work/$name" -j "$jobs" > "$work/$name.log" 2>&1 \
    || { cat "$work/$name.log"; fail "$name does not build"; }
  ctest --test-dir "$work/$name" --output-on-failure --no-tests=error > "$work/$name.log" 2>&1 \
    || { cat "$work/$name.log"; fail "$name does not run"; }
}

rm -rf "$work" && mkdir -p "$work"
say "install, and move what was installed"
cmake --install "$build" --component cpp --prefix "$work/staged" > "$work/install.log"
mv "$work/staged" "$work/installed"
prefix=$work/installed
if grep -rlF -e "$repository" -e "$work/staged" "$prefix"; then
  fail "files of the installed tree name places of the machine that built them"
fi
pkgconfig=$(dirname "$(find "$prefix" -name tensegrity.pc)")
export PKG_CONFIG_PATH=$pkgconfig

build_and_run "$consumers" package -DCMAKE_PREFIX_PATH="$prefix"
build_and_run "$consumers" subdirectory -DUSE=subdirectory -DTENSEGRITY_SOURCE_DIR="$repository"
build_and_run "$consumers" fetch -DUSE=fetch -DTENSEGRITY_SOURCE_DIR="$repository"
cmake --install "$work/subdirectory" --prefix "$work/others" > /dev/null
[ ! -e "$work/others/include" ] || fail "installing another project installs tensegrity, too"

say "pkg-config"
# shellcheck disable=SC2046 # several words each
{
  c++ -std=c++17 "$consumers/shape.cpp" $(pkg-config --cflags tensegrity) -o "$work/shape"
  c++ -std=c++17 "$consumers/reference_shape.cpp" \
    $(pkg-config --cflags --libs tensegrity_ipopt) -o "$work/reference_shape"
  cc -std=c99 -Wall -Wextra -Wpedantic -Werror "$repository/examples/c/01_streaming.c" \
    $(pkg-config --cflags --libs tensegrity_c) -o "$work/streaming"
}
"$work/shape"
"$work/reference_shape"
"$work/streaming" > /dev/null

say "a program in float and a library in double"
if cc -DTENSEGRITY_SINGLE "$repository/examples/c/01_streaming.c" -I "$prefix/include" \
    -L "$(dirname "$pkgconfig")" -ltensegrity_c -lm -o "$work/mismatch" 2> "$work/mismatch.log"; then
  fail "they link"
fi
grep -q 'tensegrity_create_full_f32' "$work/mismatch.log" || fail "$(cat "$work/mismatch.log")"

build_and_run "$repository/examples/c" examples-c -DCMAKE_PREFIX_PATH="$prefix"
build_and_run "$repository/examples/cpp" examples-cpp -DCMAKE_PREFIX_PATH="$prefix" \
  -DTENSEGRITY_EXAMPLE_RECORDING="$recording"
say "passed"
