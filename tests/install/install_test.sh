#!/usr/bin/env bash
# Installs the build to an empty prefix, then builds and runs a project that knows nothing but
# find_package(Trueline); the installed command line works from there too.
set -euo pipefail
source_dir=${TRUELINE_TEST_SOURCE_DIR:?run by ctest}
build_dir=${TRUELINE_TEST_BUILD_DIR:?run by ctest}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
fail() { echo "FAILED: $1" >&2; exit 1; }

cmake --install "$build_dir" --prefix "$scratch/prefix" >"$scratch/install.log"

cmake -S "$source_dir/tests/install/consumer" -B "$scratch/consumer" -G Ninja \
  -DCMAKE_BUILD_TYPE=Debug -DCMAKE_PREFIX_PATH="$scratch/prefix" >"$scratch/configure.log"
cmake --build "$scratch/consumer"
output=$("$scratch/consumer/consumer")
[[ $output == version\ *,\ sum\ 6 ]] || fail "the consumer printed '$output'"

# Nothing that was installed may point back to where it was built.
if grep -rlF "$build_dir" "$scratch/prefix/lib"*/cmake "$scratch/prefix/include"; then
  fail "installed files name the build folder"
fi
[[ -f $scratch/prefix/share/trueline/report/report.py ]] || fail "the report scripts are missing"
[[ -d $scratch/prefix/share/trueline/config ]] || fail "the configurations are missing"
"$scratch/prefix/bin/trueline" --help | grep -q '^Verbs:' || fail "trueline --help lists no verbs"
for program in "$build_dir"/apps/trueline*; do
  [[ -x $scratch/prefix/bin/$(basename "$program") ]] || fail "$(basename "$program") is missing"
done
echo "installed, found, built and run"
