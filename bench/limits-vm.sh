#!/bin/sh
# bench/limits.sh in a virtual machine with cgroup v2: the kernel of Debian, emulated by QEMU, and a root
# file system of busybox, `armor` and its libraries. As root, or any user where the three packages are
# installed or can be downloaded:
#   bench/limits-vm.sh [ARMOR]
# An emulated processor is some 20 times slower than a real one.
set -eu
bench=$(cd "$(dirname "$0")" && pwd)
armor=${1:-target/release/armor}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
command -v qemu-system-x86_64 > /dev/null || apt-get install -y --no-install-recommends qemu-system-x86
cd "$folder"
kernel=$(apt-cache depends linux-image-cloud-amd64 | awk '/Depends: linux-image/ { print $2; exit }')
apt-get download "$kernel" busybox-static
for package in *.deb; do dpkg -x "$package" packages; done
cd "$OLDPWD"
root=$folder/root
mkdir -p "$root/bin" "$root/proc" "$root/sys" "$root/dev" "$root/tmp" "$root/etc" "$root/modules"
cp "$folder/packages/bin/busybox" "$root/bin/"
cp "$armor" "$root/bin/armor"
cp "$bench/limits.sh" "$root/"
ldd "$armor" | grep -o '/[^ ]*' | while read -r library; do
    mkdir -p "$root$(dirname "$library")"
    cp "$library" "$root$library"
done
# Both ends of a connection ask the kernel for the user of the other one.
for module in net/unix/unix_diag net/ipv4/inet_diag net/ipv4/tcp_diag; do
    cp "$folder"/packages/lib/modules/*/kernel/$module.ko "$root/modules/"
done
cat > "$root/init" <<'INIT'
#!/bin/busybox sh
/bin/busybox --install -s /bin
export PATH=/bin HOME=/tmp
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t devtmpfs dev /dev
mkdir /dev/shm
mount -t tmpfs shm /dev/shm
mount -t tmpfs tmp /tmp
mount -t cgroup2 none /sys/fs/cgroup
for module in unix_diag inet_diag tcp_diag; do insmod /modules/$module.ko; done
ip link set lo up
echo 'root:x:0:0::/tmp:/bin/sh' > /etc/passwd
uname -srm
# As `systemd-run --scope -p Delegate=yes`: a group of its own.
echo +cpu > /sys/fs/cgroup/cgroup.subtree_control
mkdir /sys/fs/cgroup/scope
cd /tmp
sh -c 'echo $$ > /sys/fs/cgroup/scope/cgroup.procs; exec sh /limits.sh /bin/armor' &
sleep 20
while [ -n "$(pidof armor)" ] || [ -n "$(pidof limits.sh)" ]; do sleep 1; done
poweroff -f
INIT
chmod +x "$root/init"
(cd "$root" && find . | ./bin/busybox cpio -o -H newc 2> /dev/null) | gzip -1 > "$folder/initrd.gz"
timeout 900 qemu-system-x86_64 -accel tcg,thread=multi -cpu Nehalem -smp 2 -m 1024 -nographic -no-reboot \
    -kernel "$folder"/packages/boot/vmlinuz-* -initrd "$folder/initrd.gz" \
    -append 'console=ttyS0 panic=-1 quiet' | sed -un '/Linux [0-9]/,$p'
