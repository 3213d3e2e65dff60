#!/usr/bin/env bash
# Makes the Debian packages of the build and unpacks them to an empty root, then builds and runs the handbook's
# example, a project that knows nothing but find_package(Trueline), and follows a tutorial with the package's programs.
#
#   tests/install/install_test.sh [--whole]      --whole: with the library for the other processors, whose first
#                                                build takes minutes
set -euo pipefail
source_dir=${TRUELINE_TEST_SOURCE_DIR:-$(realpath "$(dirname "$0")/../..")}
build_dir=${TRUELINE_TEST_BUILD_DIR:-$source_dir/build}
[[ ${1:-} == --whole ]] && whole=1 || { whole=0; export TRUELINE_INSTALL_AS_BUILT=1; }
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
fail() { echo "FAILED: $1" >&2; exit 1; }

(cd "$build_dir" && cpack -B "$scratch/packages" >"$scratch/cpack.log" 2>&1) ||
  fail "cpack: $(tail -5 "$scratch/cpack.log")"
for package in "$scratch"/packages/*.deb; do dpkg-deb -x "$package" "$scratch/root"; done
prefix=$scratch/root/usr

block() { sed -n "/^\`\`\`$1\$/,/^\`\`\`\$/p" "$source_dir/config/handbook/library.md" | grep -v '^```'; }
mkdir "$scratch/example"
block cmake >"$scratch/example/CMakeLists.txt"
block cpp >"$scratch/example/main.cc"
cmake -S "$scratch/example" -B "$scratch/consumer" -G Ninja \
  -DCMAKE_BUILD_TYPE=Debug -DCMAKE_PREFIX_PATH="$prefix" >"$scratch/configure.log"
cmake --build "$scratch/consumer"
"$prefix/bin/trueline" simulate --config="$source_dir/config/simulate/iros2016.yaml" --duration=40 \
  --out="$scratch/log" --quiet
output=$("$scratch/consumer/consumer" "$scratch/log")
[[ $output == verdict\ *K_x\ -0.4* ]] || fail "the example printed '$output'"
"$scratch/consumer/consumer" "$scratch" 2>"$scratch/error" && fail "the example takes a folder without a log"
grep -q log.yaml "$scratch/error" || fail "the example does not say what is missing: $(cat "$scratch/error")"

# Nothing that was installed may point back to where it was built.
if grep -rlF "$build_dir" "$prefix/lib"*/cmake "$prefix/include"; then
  fail "installed files name the build folder"
fi
share=$prefix/share/trueline
/usr/bin/python3 "$share/report/report.py" --help >/dev/null || fail "the report scripts do not run"
[[ -f $share/report/page.css ]] || fail "the style of the report is missing"
[[ -d $share/config ]] || fail "the configurations are missing"
[[ -f $share/handbook/index.html ]] || fail "the handbook is missing"
if [[ -d $build_dir/python ]]; then
  found=$(PYTHONPATH="$prefix/lib/python3/dist-packages" /usr/bin/python3 -c '
import trueline
print(trueline.config("simulate/hippodrome.yaml"))')
  [[ $found == "$share"/* ]] || fail "the Python module finds its configurations in '$found'"
fi
"$prefix/bin/trueline" --help | grep -q '^Verbs:' || fail "trueline --help lists no verbs"
for program in "$build_dir"/apps/trueline*; do
  [[ -x $prefix/bin/$(basename "$program") ]] || fail "$(basename "$program") is missing"
done
TRUELINE_PROGRAMS=$prefix/bin /usr/bin/python3 "$source_dir/tests/tutorials/tutorial.py" crazyflie.md ||
  fail "a tutorial fails with the package's programs"

# Where the library is built for AVX2, the programs and the library for other processors are not, and
# the loader takes the one that the processor can run.
fast=$prefix/lib/glibc-hwcaps/x86-64-v3
avx() { objdump -d --no-show-raw-insn "$1" | grep -m1 -cE '[[:space:]]v[a-z0-9]+ .*%[xyz]mm' || true; }
if [[ -d $fast ]] && grep -q -E '^TRUELINE_AVX2:BOOL=(ON|1)$' "$build_dir/CMakeCache.txt"; then
  other=$(ninja -C "$build_dir" -t commands trueline_other_processor)
  [[ -n $other && $other != *-mavx2* ]] || fail "the other library is compiled for AVX2"
  plain=("$prefix"/bin/trueline*)
  [[ $whole == 0 ]] || plain+=("$prefix"/lib/libtrueline.so.*.*.*)
  for file in "${plain[@]}"; do
    (($(avx "$file") == 0)) || fail "$(basename "$file") has instructions of AVX"
  done
  (($(avx "$(echo "$fast"/libtrueline.so.*.*.*)") > 0)) || fail "x86-64-v3 has no AVX"
  effects=$prefix/bin/trueline-effects
  loaded() { env LD_DEBUG=libs "$@" 2>&1 >/dev/null | sed -n 's/.*calling init: \(.*libtrueline[^ ]*\).*/\1/p'; }
  taken=$(loaded "$effects")
  [[ $taken == */x86-64-v3/* ]] || fail "with AVX2 the loader takes '$taken'"
  taken=$(loaded GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2 "$effects")
  [[ -n $taken && $taken != */x86-64-v3/* ]] || fail "without AVX2 the loader takes '$taken'"
  cmp -s <("$effects") <(GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2 "$effects") || fail "the two libraries differ"
fi
echo "packed, unpacked, found, built and run"
