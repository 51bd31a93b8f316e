#!/bin/bash
# Installs the Debian packages that building, testing and running the chain need. Does nothing, quietly and without root, when
# all are there.   Usage: pipeline/setup.sh [--list]
set -euo pipefail

packages=(
    # tools
    g++ cmake ninja-build make git ca-certificates pkg-config ccache
    # libraries (cmake/dependencies.cmake)
    libopenvdb-dev libboost-iostreams-dev libtbb-dev libeigen3-dev libcgal-dev libhdf5-dev libfftw3-dev libtiff-dev libpng-dev
    zlib1g-dev libcli11-dev libtomlplusplus-dev libfmt-dev libspdlog-dev nlohmann-json3-dev libgtest-dev libbenchmark-dev
    # report
    gnuplot-nox libjs-dygraphs libjs-three
)

if [ "${1:-}" = --list ]; then
    printf '%s\n' "${packages[@]}"
    exit 0
fi

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
    echo "setup.sh: this is no Debian system (no apt-get); install the equivalents of these packages, then run again with SETUP=no:" >&2
    printf '  %s\n' "${packages[*]}" >&2
    exit 1
fi

installed=$(dpkg-query --show --showformat '${db:Status-Status} ${Package}\n' | sed -n 's/^installed //p')
missing=()
for package in "${packages[@]}"; do
    grep -qxF "$package" <<<"$installed" || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] && exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null; then
        echo "setup.sh: packages are missing and there is no sudo; as root run: apt-get install --no-install-recommends ${missing[*]}" >&2
        exit 1
    fi
    as_root=(sudo)
fi
echo "setup.sh: installing ${#missing[@]} packages: ${missing[*]}" >&2
install() {
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install --yes --quiet --no-install-recommends "${missing[@]}" </dev/null >&2
}
# The package lists may be absent (a bare system) or stale (a package has moved on): refresh them, then try again.
if [ -z "$(find /var/lib/apt/lists -name '*_Packages*' -print -quit 2>/dev/null)" ] || ! install; then
    "${as_root[@]}" apt-get update --quiet >&2
    install
fi
