#!/bin/sh
# Packs a program with both boards' firmware: into an archive, and where Python's wheel takes them
# from. Run in the project's root: pack.sh PROGRAM FIRMWARE FILES NAME, with the folder of the
# firmware, the folder for NAME.tar.gz, and the archive's name.
set -eu
program=$1 firmware=$2 files=$3 name=$4
wheel=host-tool/python/hivtac.data packed=target/xtask/release/$name
rm -rf "$packed"
mkdir -p "$files" "$wheel/scripts" "$wheel/data/share/hivtac/firmware" "$packed/firmware"
for folder in "$wheel/scripts" "$packed"; do cp "$program" "$folder"; done
for folder in "$wheel/data/share/hivtac" "$packed"; do
    cp "$firmware"/hivtac-firmware-*.bin "$folder/firmware"
done
cp README.md CHANGELOG.md LICENSE-APACHE LICENSE-MIT "$packed"
tar -czf "$files/$name.tar.gz" -C "$packed/.." "$name"
rm -r "$packed"
