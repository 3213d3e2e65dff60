#!/usr/bin/env bash
# Installs the build to an empty prefix, then builds and runs the handbook's example, a project that knows nothing
# but find_package(Trueline); the installed command line works from there too.
set -euo pipefail
source_dir=${TRUELINE_TEST_SOURCE_DIR:?run by ctest}
build_dir=${TRUELINE_TEST_BUILD_DIR:?run by ctest}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
fail() { echo "FAILED: $1" >&2; exit 1; }

# Without the library for the other processors, whose build takes minutes: scripts/install/check_package
# looks at whole packages.
TRUELINE_INSTALL_AS_BUILT=1 cmake --install "$build_dir" --prefix "$scratch/prefix" >"$scratch/install.log"

block() { sed -n "/^\`\`\`$1\$/,/^\`\`\`\$/p" "$source_dir/config/handbook/library.md" | grep -v '^```'; }
mkdir "$scratch/example"
block cmake >"$scratch/example/CMakeLists.txt"
block cpp >"$scratch/example/main.cc"
cmake -S "$scratch/example" -B "$scratch/consumer" -G Ninja \
  -DCMAKE_BUILD_TYPE=Debug -DCMAKE_PREFIX_PATH="$scratch/prefix" >"$scratch/configure.log"
cmake --build "$scratch/consumer"
"$scratch/prefix/bin/trueline" simulate --config="$source_dir/config/simulate/iros2016.yaml" --duration=40 \
  --out="$scratch/log" --quiet
output=$("$scratch/consumer/consumer" "$scratch/log")
[[ $output == verdict\ *K_x\ -0.4* ]] || fail "the example printed '$output'"
"$scratch/consumer/consumer" "$scratch" 2>"$scratch/error" && fail "the example takes a folder without a log"
grep -q log.yaml "$scratch/error" || fail "the example does not say what is missing: $(cat "$scratch/error")"

# Nothing that was installed may point back to where it was built.
if grep -rlF "$build_dir" "$scratch/prefix/lib"*/cmake "$scratch/prefix/include"; then
  fail "installed files name the build folder"
fi
share=$scratch/prefix/share/trueline
/usr/bin/python3 "$share/report/report.py" --help >/dev/null || fail "the report scripts do not run"
[[ -f $share/report/page.css ]] || fail "the style of the report is missing"
[[ -d $share/config ]] || fail "the configurations are missing"
[[ -f $share/handbook/index.html ]] || fail "the handbook is missing"
if grep -rlF 'href="file:' "$share/handbook"; then fail "the handbook links to the source"; fi
if [[ -d $build_dir/python ]]; then
  found=$(PYTHONPATH="$scratch/prefix/lib/python3/dist-packages" /usr/bin/python3 -c '
import trueline
print(trueline.config("simulate/hippodrome.yaml"))')
  [[ $found == "$share"/* ]] || fail "the Python module finds its configurations in '$found'"
fi
"$scratch/prefix/bin/trueline" --help | grep -q '^Verbs:' || fail "trueline --help lists no verbs"
for program in "$build_dir"/apps/trueline*; do
  [[ -x $scratch/prefix/bin/$(basename "$program") ]] || fail "$(basename "$program") is missing"
done

# Where the library is built for AVX2, the programs and the library for other processors are not, and
# the loader takes the one that the processor can run.
fast=("$scratch"/prefix/lib*/glibc-hwcaps/x86-64-v3/libtrueline.so.?.?)
if [[ -e ${fast[0]} ]] && grep -q -E '^TRUELINE_AVX2:BOOL=(ON|1)$' "$build_dir/CMakeCache.txt"; then
  other=$(ninja -C "$build_dir" -t commands trueline_other_processor)
  [[ -n $other && $other != *-mavx2* ]] || fail "the other library is compiled for AVX2"
  for program in "$scratch"/prefix/bin/trueline*; do
    found=$(objdump -d --no-show-raw-insn "$program" | grep -cE '[[:space:]]v[a-z0-9]+ .*%[xyz]mm' || true)
    ((found == 0)) || fail "$(basename "$program") has $found instructions of AVX"
  done
  loaded() { env LD_DEBUG=libs "$@" 2>&1 >/dev/null | sed -n 's/.*calling init: \(.*libtrueline[^ ]*\).*/\1/p'; }
  taken=$(loaded "$scratch/prefix/bin/trueline-effects")
  [[ $taken == */x86-64-v3/* ]] || fail "with AVX2 the loader takes '$taken'"
  taken=$(loaded GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2 "$scratch/prefix/bin/trueline-effects")
  [[ -n $taken && $taken != */x86-64-v3/* ]] || fail "without AVX2 the loader takes '$taken'"
fi
echo "installed, found, built and run"
