#!/bin/sh
# The steps of compose.yaml without containers: secrets, one server, the wait for its health, two simulated cameras.
#   sh docker/by_hand.sh FOLDER [PORT]
# FOLDER receives tokens and takes. `studio` is the one on the path, or what STUDIO names. Ctrl-C ends all in order.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
folder=${1:?give a folder for tokens and takes}
port=${2:-8000}
studio=${STUDIO:-studio}
mkdir -p "$folder/docker" "$folder/sessions"
cp "$here/secrets.sh" "$folder/docker/"
sh "$folder/docker/secrets.sh"
export STUDIO_CAMERA_TOKEN_FILE="$folder/docker/camera_token"
export STUDIO_OPERATOR_TOKEN_FILE="$folder/docker/operator_token"
started=""
end() {
    for process in $started; do kill -TERM "$process" 2>/dev/null || true; done
    for process in $started; do wait "$process" 2>/dev/null || true; done
}
trap end EXIT
trap 'exit 0' INT TERM

STUDIO_HOST=0.0.0.0 STUDIO_PORT="$port" STUDIO_SESSIONS="$folder/sessions" STUDIO_LOG_FORMAT=json $studio serve &
server=$!
started="$server"
tries=0
until python3 -c "import urllib.request as r; r.urlopen('http://127.0.0.1:$port/health', timeout=3)" 2>/dev/null; do
    tries=$((tries + 1))
    if [ "$tries" -gt 120 ] || ! kill -0 "$server" 2>/dev/null; then
        echo "the server does not come up" >&2
        exit 1
    fi
    sleep 0.5
done
for camera in 0:left 1:right; do
    $studio camera --source "simulated:${camera%:*}/2" --server "http://127.0.0.1:$port" --name "${camera#*:}" \
        --spool "$folder/spool-${camera#*:}" &
    started="$! $started"
done
echo "two cameras send to http://127.0.0.1:$port"
wait "$server"
