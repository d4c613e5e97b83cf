#!/bin/sh
# Installs the programs that some tests need, where that is possible; tests skip with a reason where it is not.
# Usage: install_programs.sh VIRTUAL_ENVIRONMENT
set -u
folder=$(cd "$(dirname "$0")" && pwd)
axe="${1:-.venv}/axe" caddy="$(realpath "${1:-.venv}")/caddy"

have() {
    command -v "$1" >/dev/null 2>&1
}

have_postgresql() {
    have initdb || ls /usr/lib/postgresql/*/bin/initdb >/dev/null 2>&1
}

have_chromium() {
    have chromium || have chromium-browser || have google-chrome
}

packages=""
have_postgresql || packages="$packages postgresql"
have_chromium || packages="$packages chromium fonts-dejavu-core"
have npm || packages="$packages npm"
have mosquitto || [ -x /usr/sbin/mosquitto ] || packages="$packages mosquitto"
if [ -n "$packages" ]; then
    if [ "$(id -u)" -eq 0 ] && have apt-get; then
        # The tests start a server of their own: keep PostgreSQL's package from creating and starting one.
        if [ ! -e /etc/postgresql-common/createcluster.conf ]; then
            mkdir -p /etc/postgresql-common
            echo "create_main_cluster = false" >/etc/postgresql-common/createcluster.conf
        fi
        export DEBIAN_FRONTEND=noninteractive
        export RUNLEVEL=1 # Debian starts no service of a package at this level, such as Mosquitto
        apt-get update -qq
        for package in $packages; do
            apt-get install -y -qq --no-install-recommends -o Dpkg::Options::=--force-confold "$package" >/dev/null \
                || echo "$package could not be installed: the tests that need it will be skipped."
        done
    else
        echo "Not here, and not to be installed without root and apt:$packages. Tests that need them will be skipped."
    fi
fi

# Caddy is taken out of its package, which would start a web server.
if ! have caddy && have apt-get && [ ! -e "$caddy/usr/bin/caddy" ]; then
    scratch=$(mktemp -d)
    [ "$(id -u)" -ne 0 ] || apt-get update -qq
    (cd "$scratch" && apt-get download -qq caddy && dpkg-deb -x caddy_*.deb "$caddy") >/dev/null 2>&1 \
        || echo "Caddy could not be fetched: the test that needs it will be skipped."
    rm -r "$scratch"
fi

# axe-core looks for faults of accessibility in the page.
if have npm && [ ! -e "$axe/node_modules/axe-core/axe.min.js" ]; then
    mkdir -p "$axe" && cp "$folder/api/page/package.json" "$folder/api/page/package-lock.json" "$axe/"
    npm ci --silent --no-audit --no-fund --prefix "$axe" >/dev/null 2>&1 \
        || echo "axe-core could not be installed: its tests will be skipped."
fi
exit 0
