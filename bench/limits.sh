#!/bin/sh
# What the limits `cpu` and `memory` of a component do, with the real `armor run`:
#   bench/limits.sh [ARMOR]
# It needs a group of cgroup v2 of its own with the controller `cpu`, for example
#   systemd-run --user --scope -p Delegate=yes bench/limits.sh
# Where there is none, bench/limits-vm.sh starts it in a virtual machine.
set -eu
armor=${1:-target/release/armor}
case $armor in /*) ;; *) armor=$PWD/$armor ;; esac
folder=$(mktemp -d)
cd "$folder"
mkdir components
mkdir -m 700 runtime
export XDG_RUNTIME_DIR="$folder/runtime"
make_kind() {
    {
        echo '#!/bin/sh'
        echo "[ \"\$1\" = --describe ] && echo '{\"armor_manifest\":1,\"kind\":\"$1\",\"summary\":\"a script\",\"inputs\":[],\"outputs\":[],\"parameters\":[]}' && exit"
        echo "$2"
    } > "components/$1"
    chmod +x "components/$1"
}
make_kind busy 'while :; do :; done'
make_kind two-busy 'while :; do :; done & while :; do :; done'
make_kind eater 'sleep 2; x=0123456789; while :; do x=$x$x; done'
cat > limits.xml <<'X'
<armor version="1"><system name="limits">
  <component name="free" kind="busy"/>
  <component name="half" kind="busy" cpu="50%"/>
  <component name="quarter" kind="two-busy" cpu="25%"/>
  <component name="eater" kind="eater" memory="32MiB"/>
</system></armor>
X
# `exec`, so that a scope contains nothing but this process and `armor run`, which it becomes last.
measure() {
    # Processor time of all processes of a component, in ticks of 10 ms.
    list_processes() { grep -l "/$1\$" /proc/[0-9]*/cgroup 2>/dev/null | cut -d/ -f3; }
    ticks() {
        for pid in $(list_processes "$1"); do cat "/proc/$pid/stat" 2>/dev/null; done |
            sed 's/.*) //' | awk '{ sum += $12 + $13 } END { print sum + 0 }'
    }
    uptime() { cut -d' ' -f1 /proc/uptime; }
    waited=0
    until [ -n "$(list_processes quarter)" ]; do
        waited=$((waited + 1))
        if [ "$waited" -gt 120 ] || ! kill -0 "$1" 2> /dev/null; then
            cat run.log
            echo "no component runs"
            exit 1
        fi
        sleep 1
    done
    # The components start one after the other.
    sleep 10
    echo "component   cpu    cores used in 5 s"
    for round in 1 2 3; do
        from=$(uptime)
        free=$(ticks free) half=$(ticks half) quarter=$(ticks quarter)
        sleep 5
        row() { echo "$1 $2 $(ticks "$1") $3 $(uptime) $from" | awk '{ printf "%-10s  %-5s  %.2f\n", $1, $2, ($3 - $4) / 100 / ($5 - $6) }'; }
        row free none "$free"
        row half '50%' "$half"
        row quarter '25%' "$quarter"
    done
    echo "memory=\"32MiB\":"
    waited=0
    until grep -q 'eater.*given up' run.log || [ "$waited" -gt 60 ]; do
        waited=$((waited + 1))
        sleep 1
    done
    grep ' eater ' run.log | tail -n 3
    "$armor" ps eater || true
    kill "$1"
    sleep 3
    rm -rf "$folder"
}
# This process becomes `armor run`; what measures is its child, and moves with it.
own=$$
measure "$own" &
exec "$armor" run limits.xml --headless --components components --out out > run.log 2>&1
