#!/bin/sh
# Installs a release in a new Debian, as install.sh does here: debian.sh FILES WORK VERSION
set -eu
files=$1 debian=$2/debian version=$3
if [ "$(id -u)" != 0 ] || [ -z "$(command -v debootstrap)" ]; then
    echo "not installed in a new Debian: that needs root and the program debootstrap"
    exit
fi
rm -rf "$debian"
debootstrap --variant=minbase --include=python3-venv,python3-numpy stable "$debian"
mkdir "$debian/files"
cp "$files"/* "$(dirname "$0")"/* "$debian/files"
PIP_NO_INDEX=1 chroot "$debian" sh /files/install.sh /files /tmp "$version"
rm -r "$debian"
