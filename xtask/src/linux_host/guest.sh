#!/bin/sh
# Makes the guest in this folder: `kernel` and `initramfs` of Debian's packages, unpacked and not
# installed, and the host tool. Then runs it in QEMU, and fails if it printed a failure.
# guest.sh TOOL INIT, with PORT, FORCES and TIMES for INIT.
set -eu
tool=$1 init=$2

# Unpacks a package into packages/NAME, if it is not there already.
package() {
    [ -d "packages/$1" ] && return
    rm -rf fresh && mkdir -p fresh packages
    (cd fresh && apt-get download "$1")
    dpkg-deb --extract fresh/*.deb fresh/files
    mv fresh/files "packages/$1"
}

# The package that has the present kernel: linux-image-6.1.0-56-amd64.
linux=$(apt-cache show --no-all-versions linux-image-amd64 |
    sed -n 's/^Depends: \(linux-image-[^ ,]*\).*/\1/p')
for name in "$linux" busybox-static usbip usbutils; do package "$name"; done
busybox=packages/busybox-static/bin/busybox
cp "packages/$linux"/boot/vmlinuz* kernel

rm -rf root
mkdir -p root/bin root/modules root/proc root/sys root/dev
# Each module after those that it needs; some are part of the kernel itself.
modules=
for module in usb-common usbcore usbip-core vhci-hcd cdc-acm e1000; do
    file=$(find "packages/$linux" -name "$module.ko" -o -name "$module.ko.xz")
    if [ -z "$file" ]; then
        grep -rq "/$module.ko" --include=modules.builtin "packages/$linux" ||
            { echo "Debian's kernel has no $module"; exit 1; }
        continue
    fi
    cp "$file" root/modules
    case $file in *.xz) "$busybox" unxz "root/modules/$module.ko.xz" ;; esac
    modules="$modules $module"
done
for program in "$busybox" packages/usbip/usr/sbin/usbip packages/usbutils/usr/bin/usbreset \
    "$tool"; do
    cp "$program" root/bin
    # Its shared libraries, at the same places; a static program has none.
    for library in $(ldd "$program" 2> /dev/null | grep -o '/[^ ]*'); do
        mkdir -p "root$(dirname "$library")"
        cp "$library" "root$library"
    done
done
echo "PORT=$PORT FORCES=$FORCES TIMES=$TIMES MODULES='$modules'" > root/parameters
install -m 755 "$init" root/init
(cd root && find . | "../$busybox" cpio -o -H newc > ../initramfs)

# Usual are nine to sixteen minutes. The kernel's log is judged at the end, whole.
timeout 2700 qemu-system-x86_64 -accel tcg -m 512 -display none -monitor none -no-reboot \
    -nodefaults -nic user,model=e1000 -serial stdio -kernel kernel -initrd initramfs \
    -append "console=ttyS0 loglevel=1 panic=-1 log_buf_len=4M" < /dev/null |
    sed -u 's|\r||g' | tee console.txt
grep -qx "Linux has ended" console.txt || { echo "Linux did not come to its end" >&2; exit 1; }
if grep -q " \.\.\. FAIL$" console.txt; then exit 1; fi
