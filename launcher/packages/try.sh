#!/usr/bin/env bash
# Installs the packages of build.sh in a fresh Debian and uses them: launcher/packages/try.sh OUT [SUITE]
# As root, with debootstrap; SUITE is bookworm or trixie. With --cargo as the third argument it first
# builds and installs the program there as docs/install.md describes, with this host's Rust; with
# --only-cargo it does nothing else, and OUT may have no packages.
set -euo pipefail
if [ $# -lt 1 ]; then
  echo "usage: $0 OUT [SUITE [--cargo|--only-cargo]]" >&2
  exit 2
fi
packages="$(cd "$1" && pwd)"
suite="${2:-bookworm}"
with_cargo="${3:-}"
case "$with_cargo" in
  '' | --cargo | --only-cargo) ;;
  *) echo "$0: $with_cargo is neither --cargo nor --only-cargo" >&2; exit 2 ;;
esac
cd "$(dirname "$0")/../.."
for tool in debootstrap unshare; do
  command -v "$tool" >/dev/null || { echo "$0: $tool is missing" >&2; exit 1; }
done
root="$(mktemp -d)"
trap 'rm -rf --one-file-system "$root"' EXIT
debootstrap --variant=minbase "$suite" "$root" >"$root.log" 2>&1 || { tail "$root.log"; exit 1; }
rm "$root.log"
cp /etc/resolv.conf "$root/etc/"
mkdir "$root/packages"
if [ "$with_cargo" != --only-cargo ]; then
  cp "$packages"/*.deb "$root/packages/"
  cp "$packages"/*.whl "$root/packages/" 2>/dev/null || echo "$0: no wheel in $packages, so it is not tried" >&2
  (cd "$packages" && du --apparent-size --block-size=KiB ./*.deb ./*.whl 2>/dev/null || true)
fi

cat >"$root/packages/steps.sh" <<'STEPS'
set -euo pipefail
export DEBIAN_FRONTEND=noninteractive HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8
cd /root
step() { printf '== %s (%s s)\n' "$1" "$SECONDS"; }
quietly() { "$@" >/tmp/log 2>&1 || { printf '%s: failed\n' "$*"; cat /tmp/log; exit 1; }; }
install() { quietly apt-get -q -o Acquire::Retries=3 install -y --no-install-recommends "$@"; }
# Installs one of the packages, and prints how long it took and what it brought.
install_package() {
  local began before
  began="$(date +%s.%N)"
  before="$(dpkg-query -f '.\n' -W | wc -l)"
  install "$@"
  printf '%s: %.1f s, %d packages\n' "$*" "$(awk "BEGIN {print $(date +%s.%N) - $began}")" \
    "$(($(dpkg-query -f '.\n' -W | wc -l) - before))"
}
lacks_package() { # PACKAGE FILE
  if armor check "$2" >/tmp/log 2>&1 || ! grep -q "install the package \`$1\`" /tmp/log; then
    cat /tmp/log
    exit 1
  fi
}
# Runs the component of a project of `armor new` in the system of its README, for two seconds.
run_in_system() { # PROJECT EXECUTABLE
  mkdir -p "$1/components"
  cp "$2" "$1/components/"
  sed -n '/^<armor /,/^<\/armor>/p' "$1/README.md" >"$1/system.xml"
  quietly armor check --strict "$1/system.xml"
  quietly armor run "$1/system.xml" --components "$1/components" --headless --quiet --for 2s --out "$1/out"
}
quietly apt-get -q update

if [ -d /armor ]; then
  step "cargo install"
  install git curl ca-certificates gcc libc6-dev
  export CARGO_TARGET_DIR=/root/target CARGO_INSTALL_ROOT=/root/cargo
  export CARGO_HTTP_CAINFO=/packages/trusted.crt
  began=$SECONDS
  (export PATH="/rust/bin:$PATH" && cd /armor && quietly cargo install --locked --path launcher)
  printf 'built and installed: %s s; the program: %s, the build: %s\n' $((SECONDS - began)) \
    "$(du -h --apparent-size cargo/bin/armor | cut -f1)" "$(du -sh target | cut -f1)"
  cargo/bin/armor --version
  cargo/bin/armor doctor >/tmp/log || grep -A1 '^fault' /tmp/log
  quietly cargo/bin/armor run /armor/missions/office.xml --headless --quiet --for 20s --out cargo-out
  tail -n 1 /tmp/log
  # A component in Rust, with the library of the clone, as the first page of the tutorial has it.
  (export PATH="/rust/bin:/root/cargo/bin:$PATH" && cd /armor && armor new waver --path /root/waver \
    && cd /root/waver && quietly cargo test)
  rm -rf target waver
fi
if [ "$1" = --only-cargo ]; then
  step "all steps passed"
  exit
fi

step "the runtime, with nothing else"
install_package /packages/armor_*.deb
dpkg --verify armor
armor --version
# A fault of this host is no fault of the package.
armor doctor >/tmp/log || grep -A1 '^fault' /tmp/log
cp -r /usr/share/armor/missions .
for mission in missions/*.xml; do
  case "$mission" in
    # A log is given to it, and two have components of other packages, which the finding names.
    */map-from-log.xml) ;;
    */operator.xml) lacks_package armor-operator-view "$mission" ;;
    */foxglove.xml) lacks_package armor-foxglove "$mission" ;;
    *) quietly armor check "$mission" ;;
  esac
done
quietly armor run missions/office.xml --headless --quiet --for 20s --out out
tail -n 1 /tmp/log
# The library for Rust is in another package, which the error names.
if armor new blinker >/tmp/log 2>&1 || ! grep -q 'install the package `armor-dev`' /tmp/log; then
  cat /tmp/log
  exit 1
fi

step "manual pages, completions, the unit"
install man-db bash zsh fish systemd
for page in armor armor-run armor-host armor-bag-convert; do
  MANPAGER=cat man "$page" >/tmp/log 2>/tmp/warnings
  [ -s /tmp/log ] && [ ! -s /tmp/warnings ] || { cat /tmp/warnings; exit 1; }
done
bash -c '. /usr/share/bash-completion/completions/armor; complete -p armor'
zsh -f -c 'autoload -Uz compinit && compinit -u -D && echo "zsh: ${_comps[armor]}"' | grep _armor
fish -c 'complete -C "armor che"' | grep '^check'
systemd-analyze verify armor-host.service
[ "$(systemctl is-enabled armor-host.service || true)" = disabled ]

step "the windows"
for package in armor-designer armor-operator-view armor-foxglove; do
  install_package /packages/${package}_*.deb
  dpkg --verify $package
done
armor-designer --version
quietly armor-designer --check missions/office.xml
for program in armor armor-designer armor-operator-view armor-foxglove; do
  if ldd "/usr/bin/$program" | grep 'not found'; then exit 1; fi
done
quietly armor check missions/operator.xml missions/foxglove.xml
install desktop-file-utils xvfb xauth libgl1-mesa-dri
desktop-file-validate /usr/share/applications/armor-designer.desktop
# A window is there if it has to be ended.
for window in "armor-designer missions/office.xml" "armor run missions/operator.xml --quiet --out out"; do
  code=0
  timeout --signal INT --kill-after 20 15 xvfb-run -a $window >/tmp/log 2>&1 || code=$?
  if [ $code -ne 124 ] && [ $code -ne 0 ]; then cat /tmp/log; exit 1; fi
  if grep -iE 'panicked|gave up|given up' /tmp/log; then exit 1; fi
done

step "components in C and C++"
install_package /packages/armor-dev_*.deb
dpkg --verify armor-dev
install gcc g++ libc6-dev cmake make pkg-config
for language in c cpp; do
  armor new "counter-$language" "--$language"
  quietly cmake -S "counter-$language" -B "build-$language"
  quietly cmake --build "build-$language"
  quietly ctest --test-dir "build-$language" --output-on-failure
  tail -n 3 /tmp/log
  run_in_system "counter-$language" "build-$language/counter-$language"
done
# pkg-config links the shared library, which the package has where the loader looks for it.
cc -std=c11 counter-c/src/main.c counter-c/src/component.c -o counter-c-shared $(pkg-config --cflags --libs armor)
ldd counter-c-shared | grep libarmor
./counter-c-shared --describe | head -c 60 && echo

step "a component in Rust has the library of the package"
armor new winker
test -f winker/vendor/armor/sdk/Cargo.toml
if [ -d /armor ]; then (export PATH="/rust/bin:$PATH" && cd winker && quietly cargo test); fi

if ls /packages/armor-*.whl >/dev/null 2>&1; then
  step "components in Python, from the wheel"
  install python3-venv python3-numpy
  python3 -m venv --system-site-packages venv
  quietly venv/bin/pip install --no-index --find-links /packages armor
  armor new watcher --python
  (. venv/bin/activate && cd watcher && quietly python3 -m unittest && cd .. && run_in_system watcher watcher/watcher.py)
  venv/bin/python -c 'import armor; print(armor.__file__)' | grep venv
fi

if ls /packages/python3-armor_*.deb >/dev/null 2>&1; then
  step "components in Python, from the package"
  install_package /packages/python3-armor_*.deb
  dpkg --verify python3-armor
  python3 -c 'import armor, armor.messages, armor.testing; print(armor.__file__)'
  armor new seeker --python
  (cd seeker && quietly python3 -m unittest)
  run_in_system seeker seeker/seeker.py
fi

step "removed"
quietly apt-get -q purge -y 'armor*' 'python3-armor*'
left="$(find /usr /etc /opt /var/lib /run -ipath '*armor*' ! -ipath '*apparmor*')"
[ -z "$left" ] || { printf 'left behind:\n%s\n' "$left"; exit 1; }
step "all steps passed"
STEPS

inside() {
  mount -t proc proc "$root/proc"
  mount -t tmpfs tmpfs "$root/dev/shm" 2>/dev/null || { mkdir -p "$root/dev/shm"; mount -t tmpfs tmpfs "$root/dev/shm"; }
  if [ -n "$with_cargo" ]; then
    # The toolchain itself: rustup's own commands choose among several.
    toolchain="$(rustc --print sysroot)"
    # What this host trusts: its network may have a certificate of its own.
    cp "${SSL_CERT_FILE:-/etc/ssl/certs/ca-certificates.crt}" "$root/packages/trusted.crt"
    mkdir -p "$root/armor" "$root/rust" "$root/cargo-home"
    mount --bind "$PWD" "$root/armor"
    mount --bind "$toolchain" "$root/rust"
    mount --bind "${CARGO_HOME:-$HOME/.cargo}" "$root/cargo-home"
    chroot "$root" env -i CARGO_HOME=/cargo-home PATH=/rust/bin:/usr/sbin:/usr/bin:/sbin:/bin bash /packages/steps.sh "$with_cargo"
  else
    chroot "$root" env -i bash /packages/steps.sh ""
  fi
}
export root with_cargo
export -f inside
# The mounts end with their namespace.
unshare --mount --propagation private bash -euo pipefail -c inside
