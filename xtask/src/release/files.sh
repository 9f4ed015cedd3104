#!/bin/sh
# Makes files of a release beside its firmware: for each Linux computer an archive and Python's
# wheel, and what the host tool is made of, as CycloneDX; each wheel has its own list. Run in the
# project's root, with zig and maturin in the path: files.sh FILES VERSION TARGET...
set -eu
files=$1 version=$2
shift 2
here=xtask/src/release wheel=host-tool/python/hivtac.data
# Programs without symbols are a third as large. The profile's own `strip` does not reach packages
# that have settings of their own there.
export RUSTFLAGS="-C strip=symbols"
# The wheel's other files are the project's own.
trap 'rm -rf $wheel/scripts $wheel/data/share/hivtac/firmware' EXIT
for target in "$@"; do
    rustup target add "$target"
    case $target in
        # The oldest C library that wheels allow.
        *-gnu) linked=$target.2.17 system=manylinux2014 ;;
        *) linked=$target system=musllinux_1_2 ;;
    esac
    cargo zigbuild --release --package hivtac --bin hivtac --target "$linked"
    sh $here/pack.sh "target/$target/release/hivtac" "$files" "$files" "hivtac-$version-$target"
    (cd host-tool/python &&
        maturin build --release --zig --compatibility $system --target "$target" --out "$files")
done

cargo cyclonedx --version > /dev/null 2>&1 || cargo install --locked cargo-cyclonedx
list=hivtac-$version.cdx
# It writes one beside each manifest of the workspace.
cargo cyclonedx --format json --override-filename "$list" --manifest-path host-tool/Cargo.toml
mv "host-tool/$list.json" "$files"
find . -path ./target -prune -o -name "$list.json" -exec rm {} +
