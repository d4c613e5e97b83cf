#!/bin/sh
# Installs the programs that some tests need, where that is possible; tests skip with a reason where it is not.
set -u

have_postgresql() {
    command -v initdb >/dev/null 2>&1 || ls /usr/lib/postgresql/*/bin/initdb >/dev/null 2>&1
}

have_postgresql && exit 0
if [ "$(id -u)" -ne 0 ] || ! command -v apt-get >/dev/null 2>&1; then
    echo "PostgreSQL is not here and cannot be installed (needs root and apt): its tests will be skipped."
    exit 0
fi
# The tests start a server of their own: keep the package from creating and starting one.
if [ ! -e /etc/postgresql-common/createcluster.conf ]; then
    mkdir -p /etc/postgresql-common
    echo "create_main_cluster = false" >/etc/postgresql-common/createcluster.conf
fi
export DEBIAN_FRONTEND=noninteractive
apt-get update -qq && apt-get install -y -qq --no-install-recommends -o Dpkg::Options::=--force-confold postgresql >/dev/null \
    || echo "PostgreSQL could not be installed: its tests will be skipped."
exit 0
