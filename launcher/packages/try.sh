#!/usr/bin/env bash
# Installs the packages of build.sh in a fresh Debian and uses them: launcher/packages/try.sh OUT [SUITE]
# As root, with debootstrap; SUITE is bookworm or trixie. With --cargo as the third argument it also
# builds and installs the program there as docs/install.md describes, with this host's Rust.
set -euo pipefail
if [ $# -lt 1 ]; then
  echo "usage: $0 OUT [SUITE [--cargo]]" >&2
  exit 2
fi
packages="$(cd "$1" && pwd)"
suite="${2:-bookworm}"
with_cargo="${3:-}"
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
cp "$packages"/*.deb "$root/packages/"

cat >"$root/packages/steps.sh" <<'STEPS'
set -euo pipefail
export DEBIAN_FRONTEND=noninteractive HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8
cd /root
step() { printf '== %s\n' "$1"; }
install() { apt-get -q -o Acquire::Retries=3 install -y --no-install-recommends "$@" >/tmp/log 2>&1 || { cat /tmp/log; exit 1; }; }
apt-get -q update >/tmp/log 2>&1 || { cat /tmp/log; exit 1; }

step "the runtime, with nothing else"
install /packages/armor_*.deb
armor --version
armor doctor || [ $? -eq 1 ]
cp -r /usr/share/armor/missions .
armor check missions/*.xml
armor run missions/office.xml --headless --quiet --for 20s --out out
gzip -t /usr/share/man/man1/armor-run.1.gz
bash -c '. /usr/share/bash-completion/completions/armor; complete -p armor'

step "the windows"
install /packages/armor-designer_*.deb /packages/armor-operator-view_*.deb /packages/armor-foxglove_*.deb
armor-designer --version
armor-designer --check missions/office.xml
for program in armor armor-designer armor-operator-view armor-foxglove; do
  if ldd "/usr/bin/$program" | grep 'not found'; then exit 1; fi
done
armor component --help >/dev/null
armor check missions/operator.xml missions/foxglove.xml

step "components in C and C++"
install /packages/armor-dev_*.deb gcc g++ libc6-dev cmake make pkg-config
for language in c cpp; do
  armor new "counter-$language" "--$language"
  cmake -S "counter-$language" -B "build-$language" >/tmp/log 2>&1 || { cat /tmp/log; exit 1; }
  cmake --build "build-$language" >/tmp/log 2>&1 || { cat /tmp/log; exit 1; }
  ctest --test-dir "build-$language" --output-on-failure | tail -n 3
done
pkg-config --cflags --libs armor

step "a component in Rust has the library of the package"
armor new blinker
test -f blinker/vendor/armor/sdk/Cargo.toml

if ls /packages/python3-armor_*.deb >/dev/null 2>&1; then
  step "components in Python"
  install /packages/python3-armor_*.deb
  python3 -c 'import armor, armor.messages, armor.testing; print(armor.__file__)'
  armor new seeker --python
  (cd seeker && python3 -m unittest)
fi

if [ -d /armor ]; then
  step "cargo install"
  install git curl ca-certificates gcc libc6-dev
  export PATH="/rust/bin:$PATH" CARGO_TARGET_DIR=/root/target CARGO_INSTALL_ROOT=/root/cargo
  (cd /armor && cargo install --locked --path launcher)
  /root/cargo/bin/armor --version
  (cd blinker && cargo test)
fi

step "removed"
apt-get -q purge -y 'armor*' 'python3-armor*' >/tmp/log 2>&1 || { cat /tmp/log; exit 1; }
left="$(find /usr /etc -ipath '*armor*' ! -path '/usr/share/doc/*' ! -name '*apparmor*' ! -path '*apparmor*')"
[ -z "$left" ] || { printf 'left behind:\n%s\n' "$left"; exit 1; }
echo "all steps passed"
STEPS

inside() {
  mount -t proc proc "$root/proc"
  mount -t tmpfs tmpfs "$root/dev/shm" 2>/dev/null || { mkdir -p "$root/dev/shm"; mount -t tmpfs tmpfs "$root/dev/shm"; }
  if [ "$with_cargo" = --cargo ]; then
    # The toolchain itself: rustup's own commands choose among several.
    toolchain="$(rustc --print sysroot)"
    mkdir -p "$root/armor" "$root/rust" "$root/cargo-home"
    mount --bind "$PWD" "$root/armor"
    mount --bind "$toolchain" "$root/rust"
    mount --bind "${CARGO_HOME:-$HOME/.cargo}" "$root/cargo-home"
    chroot "$root" env -i CARGO_HOME=/cargo-home PATH=/rust/bin:/usr/sbin:/usr/bin:/sbin:/bin bash /packages/steps.sh
  else
    chroot "$root" env -i bash /packages/steps.sh
  fi
}
export root with_cargo
export -f inside
# The mounts end with their namespace.
unshare --mount --propagation private bash -euo pipefail -c inside
