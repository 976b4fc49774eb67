#!/bin/sh
# Installs the independent programs that tests hold the studio against into .tools/readers (never shipped):
# readers of exports: the Autodesk FBX SDK's (npm package fbx2gltf), ufbx, compiled from the source in the package
# pyufbx, and Blender (package bpy, in an environment of its own; without a wheel for any Python here its tests are
# skipped); and a reader of pages: axe (npm package axe-core), which finds what keeps people from using them.
# Needs npm, a C compiler, Python with pip. Run it from anywhere; what is there already is kept.
set -eu

FBX2GLTF=0.9.7
AXE=4.14.1
PYUFBX=0.0.7
BPY_311=4.5.15 # the wheels of bpy fit one Python each
BPY_313=5.2.3

root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
tools="$root/.tools/readers"
reader="$root/tests/engine/animation/export/readers/ufbx_joints.c"
mkdir -p "$tools"
log="$tools/fetch.log"
: >"$log"

fail() {
    echo "fetch_readers: $1; see $log" >&2
    tail -n 5 "$log" >&2
    exit 1
}

need() {
    command -v "$1" >/dev/null 2>&1 || fail "$1 is missing: install $2"
}

sdk="$tools/node_modules/fbx2gltf"
axe="$tools/node_modules/axe-core"
if ! grep -qs "\"version\": \"$FBX2GLTF\"" "$sdk/package.json" || ! grep -qs "\"version\": \"$AXE\"" "$axe/package.json"; then
    need npm "Node.js with npm"
    npm install --prefix "$tools" --no-audit --no-fund --no-save --ignore-scripts "fbx2gltf@$FBX2GLTF" "axe-core@$AXE" \
        >>"$log" 2>&1 || fail "npm could not install fbx2gltf@$FBX2GLTF and axe-core@$AXE"
fi
chmod +x "$sdk/bin/Linux/FBX2glTF" || fail "fbx2gltf has no Linux program"
"$sdk/bin/Linux/FBX2glTF" --help >>"$log" 2>&1 || fail "fbx2gltf does not run on this machine"

source="$tools/pyufbx-$PYUFBX/ufbx-c"
if [ ! -f "$source/ufbx.c" ]; then
    python=
    for candidate in python3 python /usr/bin/python3; do # an environment made by uv has no pip: look further
        if "$candidate" -m pip --version >>"$log" 2>&1; then
            python=$candidate
            break
        fi
    done
    [ -n "$python" ] || fail "no Python with pip (Debian: apt install python3-pip)"
    "$python" -m pip download --quiet --no-deps --no-binary pyufbx --dest "$tools" "pyufbx==$PYUFBX" >>"$log" 2>&1 ||
        fail "pip could not download the source of pyufbx $PYUFBX"
    tar -xzf "$tools/pyufbx-$PYUFBX.tar.gz" -C "$tools" || fail "the source of pyufbx $PYUFBX is damaged"
fi
program="$tools/ufbx_joints"
if [ ! -x "$program" ] || [ "$reader" -nt "$program" ]; then
    need cc "a C compiler (Debian: apt install gcc libc6-dev)"
    cc -I "$source" -o "$program.new" "$reader" "$source/ufbx.c" -lm >>"$log" 2>&1 ||
        fail "ufbx did not compile"
    mv "$program.new" "$program"
fi

blender="$tools/blender"
if ! "$blender/bin/python" -c 'import bpy' >>"$log" 2>&1; then
    rm -rf "$blender"
    installed=
    for pair in "3.11 $BPY_311" "3.13 $BPY_313"; do
        version=${pair%% *}
        for candidate in python3 "python$version" "/usr/bin/python$version"; do
            "$candidate" -c "import sys; sys.exit('%d.%d' % sys.version_info[:2] != '$version')" 2>>"$log" || continue
            if "$candidate" -m venv "$blender" >>"$log" 2>&1 &&
                "$blender/bin/python" -m pip install --quiet --disable-pip-version-check "bpy==${pair#* }" >>"$log" 2>&1 &&
                "$blender/bin/python" -c 'import bpy' >>"$log" 2>&1; then
                installed=yes
                break 2
            fi
            rm -rf "$blender"
        done
    done
    if [ -z "$installed" ]; then
        echo "fetch_readers: Blender (bpy) could not be installed, its tests will be skipped; see $log" >&2
    fi
fi
