#!/bin/sh
# Every check of the project. Needs Rust with rustfmt and clippy; with apt-get, installs software Vulkan and g++ where no driver
# and no C++ compiler are.
set -eu
cd "$(dirname "$0")/.."

fail() {
    echo "tests/run.sh: error: $*" >&2
    exit 1
}

command -v cargo >/dev/null || fail "no cargo: install Rust, see https://rustup.rs"
cargo fmt --version >/dev/null 2>&1 || fail "no rustfmt: run 'rustup component add rustfmt'"
cargo clippy --version >/dev/null 2>&1 || fail "no clippy: run 'rustup component add clippy'"

# Installs packages, of which the first is what is missing.
install_packages() {
    as_root=
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || fail "no sudo: install $1 yourself"
        as_root=sudo
    fi
    $as_root apt-get update
    $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "$@"
}

# A Vulkan driver announces itself by a file.
has_vulkan() {
    [ -n "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}" ] && return
    for driver in /usr/share/vulkan/icd.d/*.json /usr/local/share/vulkan/icd.d/*.json /etc/vulkan/icd.d/*.json; do
        [ -e "$driver" ] && return
    done
    return 1
}

if [ "$(uname)" = Linux ] && ! has_vulkan; then
    command -v apt-get >/dev/null || fail "no Vulkan driver and no apt-get: install Mesa's software Vulkan (lavapipe)"
    install_packages mesa-vulkan-drivers libvulkan1
fi

# The benches compare with meshoptimizer, which is C++.
if ! command -v c++ >/dev/null && command -v apt-get >/dev/null; then
    install_packages g++
fi

# A test that finds no adapter fails instead of skipping.
export REQUIRE_GPU=1
# Mesa's layer for choosing a device prints to standard error where there is no display.
export NODEVICE_SELECT=1

cargo fmt --check
cargo clippy --all-targets --locked -- -D warnings
cargo clippy --all-targets --locked --features baseline -- -D warnings
RUSTDOCFLAGS=-Dwarnings cargo doc --no-deps --locked
cargo test --locked
cargo test --locked --features baseline --test cli bench::
