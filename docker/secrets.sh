#!/bin/sh
# Makes the tokens that compose.yaml hands to the server and the cameras, where they are not there yet.
set -eu
cd "$(dirname "$0")"
umask 077
for name in operator_token camera_token; do
    if [ ! -s "$name" ]; then
        od -An -N24 -tx1 /dev/urandom | tr -d ' \n' >"$name"
        chmod 644 "$name" # the container's user is another one; the folder keeps others out
    fi
done
chmod 700 .
