#!/usr/bin/env bash
# Checks the package for C and C++: installs it into a fresh prefix, builds with nothing else the projects
# that `armor new` writes, its own tests with both sanitizers, the joystick and the filter, and runs a small system of
# components in C, C++ and Rust, of which one crashes and one throws.
#   sdk/c/check.sh [PATH OF THE PROGRAM armor]
set -euo pipefail
cd "$(dirname "$0")/../.."
armor="$(realpath "${1:-target/release/armor}")"
out="$(mktemp -d)"
run=
finish() {
  if [ -n "$run" ]; then kill -INT "$run" 2>/dev/null || true; wait "$run" 2>/dev/null || true; fi
  rm -rf "$out"
}
trap finish EXIT
# Prints the log of a command only if it fails.
quietly() { "$@" >"$out/log" 2>&1 || { cat "$out/log"; exit 1; }; }
build() { # SOURCE NAME [OPTION]…
  quietly cmake -S "$1" -B "$out/$2" -DCMAKE_PREFIX_PATH="$out/prefix" "${@:3}"
  quietly cmake --build "$out/$2" --parallel 2
}
test_built() { # NAME
  quietly ctest --test-dir "$out/$1" --output-on-failure
  grep 'tests passed' "$out/log" | sed "s|^|$1: |"
}
fail() { echo "$*" >&2; exit 1; }

quietly sdk/c/install.sh "$out/prefix"
tail -n 1 "$out/log"

# The projects of `armor new`; the name of the package is in CMake's error without it.
"$armor" new c-counter --c --path "$out/c-source" >/dev/null
"$armor" new cpp-counter --cpp --path "$out/cpp-source" >/dev/null
if cmake -S "$out/c-source" -B "$out/without" >"$out/log" 2>&1; then
  fail "the project is configured without the package"
fi
tr -s ' \n' ' ' <"$out/log" | grep -q 'The package Armor is not found. Install it from' \
  || { cat "$out/log"; fail "CMake does not name the package that is missing"; }
for language in c cpp; do
  build "$out/$language-source" "$language"
  test_built "$language"
done

build sdk/c/tests/native sanitized -DSANITIZE=ON
test_built sanitized
for component in joystick pose-filter; do
  build "components/$component" "$component"
  test_built "$component"
done

# The headers' comments, as a reader has them.
if command -v doxygen >/dev/null; then
  quietly sdk/c/reference.sh "$out/reference"
fi

# Without CMake: a C compiler and pkg-config.
if command -v pkg-config >/dev/null; then
  # shellcheck disable=SC2046
  PKG_CONFIG_PATH="$out/prefix/lib/pkgconfig" cc -std=c11 sdk/c/tests/native/relay.c -o "$out/relay" \
    $(PKG_CONFIG_PATH="$out/prefix/lib/pkgconfig" pkg-config --cflags --libs armor) -Wl,-rpath,"$out/prefix/lib"
  "$out/relay" --describe >/dev/null
fi

# What `armor message export` writes, as the tests of sdk/definitions keep it: it compiles, and in C++ has
# the schema that it was written from.
kept="$PWD/sdk/definitions/tests/kept"
echo "#include \"$kept/reading.h\"" >"$out/reading.c"
cc -std=c11 -Wall -Wextra -Werror -I "$out/prefix/include/armor" -fsyntax-only "$out/reading.c"
cat >"$out/reading.cpp" <<END
#include "$kept/reading.hpp"
#include <iostream>
int main() { std::cout << armor::schema_of<Reading>() << "\\n" << armor::schema_of<ReadingView>() << "\\n"; }
END
c++ -std=c++17 -Wall -Wextra -Werror -I "$out/prefix/include/armor" "$out/reading.cpp" -o "$out/reading" \
  "$out/prefix/lib/libarmor.a" -lgcc_s -lpthread -lm -ldl
[ "$("$out/reading" | grep -cFxf "$kept/reading.schema")" = 2 ] \
  || { "$out/reading"; fail "an exported message has another schema"; }

# The listings of the guides.
listing() { awk -v n="$2" '/^```(c|cpp)$/ { count++; inside = count == n; next } /^```/ { inside = 0 } inside' "docs/$1"; }
{
  echo '#include <armor_messages.h>'
  listing c.md 1
  listing c.md 2
  echo 'extern const armor_component component; void test(void); void test(void) {'
  listing c.md 3
  echo '}'
} >"$out/listing.c"
cc -std=c11 -Wall -Wextra -Werror -Wno-unused-function -Wno-unused-parameter \
  -I "$out/prefix/include/armor" -fsyntax-only "$out/listing.c"
{
  listing cpp.md 1 | sed 's/int main(int argc/int run(int argc/'
  listing cpp.md 2
  echo '#include <armor_testing.hpp>'
  echo 'int main() { armor::schema_of<Reading>(); LaserScanView scan;'
  listing cpp.md 3 | grep -v '^#include'
  echo '}'
} >"$out/listing.cpp"
c++ -std=c++17 -I "$out/prefix/include/armor" "$out/listing.cpp" -o "$out/listing" \
  "$out/prefix/lib/libarmor.a" -lgcc_s -lpthread -lm -ldl
"$out/listing"

# The system. The sanitizers end a crash in their own way, so its components are built without them.
quietly cmake -S sdk/c/tests/native -B "$out/native" -DCMAKE_PREFIX_PATH="$out/prefix"
quietly cmake --build "$out/native" --target relay crasher thrower
mkdir "$out/components"
cp "$out"/native/{relay,crasher,thrower} "$out/c/c-counter" "$out/cpp/cpp-counter" \
  "$out/joystick/joystick" "$out/pose-filter/pose-filter" "$out/components/"
for component in joystick pose-filter; do
  quietly "$armor" check "components/$component/$component.xml" --components "$out/components"
done
"$armor" run sdk/c/tests/native/system.xml --components "$out/components" --headless --out "$out/run" \
  --system native-check >"$out/run.log" 2>&1 &
run=$!
wait_for() { # TEXT FILE
  for _ in $(seq 300); do
    if grep -q "$1" "$2" 2>/dev/null; then return; fi
    kill -0 "$run" 2>/dev/null || break
    sleep 0.1
  done
  cat "$out/run.log"
  fail "the system does not report: $1"
}
wait_for 'crasher .*ended by signal 11 (SIGSEGV); it starts again' "$out/run.log"
wait_for 'thrower .*the third tick is too much' "$out/run.log"
# What C++ counts, C sends on, and Rust passes on, still arrives.
timeout 30 "$armor" echo passed-on.element --system native-check --count 5 >"$out/echo"
[ "$(grep -c '"count":' "$out/echo")" = 5 ] || { cat "$out/echo"; fail "nothing is passed on"; }
kill -INT "$run"
wait "$run" || true
run=
echo "the system of C, C++ and Rust: a crash and an exception are reported, the others continue"
