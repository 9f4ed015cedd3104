#!/bin/sh
# Installs a release in a new Debian of each processor that it has files for, as install.sh does
# here; a processor that is not this computer's is emulated: debian.sh FILES WORK VERSION
set -eu
files=$1 debian=$2/debian version=$3
if [ "$(id -u)" != 0 ] || [ -z "$(command -v debootstrap)" ]; then
    echo "not installed in a new Debian: that needs root and the program debootstrap"
    exit
fi
for processor in x86_64:amd64 aarch64:arm64; do
    name=${processor%:*}
    ls "$files/hivtac-$version-$name"-*-linux-*.tar.gz > /dev/null 2>&1 || continue
    if [ "$name" != "$(uname -m)" ] && [ ! -e "/proc/sys/fs/binfmt_misc/qemu-$name" ]; then
        echo "not installed on $name: that needs Debian's qemu-user-static"
        continue
    fi
    rm -rf "$debian"
    debootstrap --variant=minbase --include=python3-venv,python3-numpy \
        --arch "${processor#*:}" stable "$debian"
    mkdir "$debian/files"
    cp "$files"/* "$(dirname "$0")"/* "$debian/files"
    PIP_NO_INDEX=1 chroot "$debian" sh /files/install.sh /files /tmp "$version"
    rm -r "$debian"
done
