#!/bin/sh
# Installs the wheel of a version that runs here into an environment of its own, unpacks the
# archives, and asks their programs: install.sh FILES WORK VERSION
set -eu
files=$1 work=$2 version=$3 ask=$(dirname "$0")/ask.py
if ! ls "$files/hivtac-$version-$(uname -m)"-*-linux-*.tar.gz > /dev/null 2>&1; then
    echo "not installed here: no file is for $(uname -m)"
    exit
fi
python3 -m venv --clear --system-site-packages "$work/installed"
"$work/installed/bin/pip" install --quiet --find-links "$files" "hivtac==$version"
"$work/installed/bin/python" "$ask" \
    "$work/installed/bin/hivtac" "$work/installed/share/hivtac/firmware" "$version"
for archive in "$files/hivtac-$version-$(uname -m)"-*-linux-*.tar.gz; do
    rm -rf "$work/unpacked"
    mkdir "$work/unpacked"
    tar -xzf "$archive" -C "$work/unpacked" --strip-components=1
    "$work/installed/bin/python" "$ask" \
        "$work/unpacked/hivtac" "$work/unpacked/firmware" "$version"
done
