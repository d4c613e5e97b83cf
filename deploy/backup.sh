#!/bin/sh
# Makes a backup with the time in its name, and removes all but the newest.
# Where the backup cannot be made, or what it copies is damaged, nothing is removed, and the exit code says so.
# Usage: backup.sh FOLDER [NUMBER THAT ARE KEPT]
set -eu
folder=$1
kept=${2:-14}
jointlab store backup "$folder/jointlab-$(date -u +%Y-%m-%dT%H%M%SZ).zip"
find "$folder" -maxdepth 1 -name 'jointlab-*.zip' | sort -r | tail -n "+$((kept + 1))" | while read -r old; do
    rm -- "$old"
done
