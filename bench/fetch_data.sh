#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Makes the sets of the figures from Debian's packages alone, so that anyone can repeat them:
#
#     bench/fetch_data.sh headscan [NODES [FOLDER]]            a CT of a head, from the package invesalius-examples
#     bench/fetch_data.sh droplets|splash [NODES [FOLDER [FRAMES]]]   liquids, simulated by Debian's Blender
#     ./dev bench build/bench-data/headscan/set.json           what to do with them
#
# NODES (129) a side; FOLDER is build/bench-data/NAME; 20 FRAMES. The head scan is under GPL-2: it stays out of the repository.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

usage() { sed -n 's/^# \{0,1\}//; 3,9p' bench/fetch_data.sh; }

# install PACKAGE...: those that are missing
install() {
  local as_root=()
  dpkg -s "$@" >/dev/null 2>&1 && return
  ((EUID == 0)) || as_root=(sudo)
  "${as_root[@]}" apt-get update -q
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "$@"
}

set_name=${1:-}
nodes=${2:-129}
folder=${3:-build/bench-data/$set_name}
frames=${4:-20}
case "$set_name" in
  headscan)
    install python3 python3-numpy
    scratch=$(mktemp -d)
    trap 'rm -rf "$scratch"' EXIT
    # The package itself would bring the whole program along: only its files are wanted.
    (cd "$scratch" && apt-get download -q invesalius-examples && dpkg-deb -x invesalius-examples_*.deb .)
    /usr/bin/python3 bench/data/head_scan.py "$scratch"/usr/share/doc/invesalius-examples/examples/Cranium.inv3 "$nodes" "$folder"
    ;;
  droplets | splash)
    install blender
    mkdir -p "$folder"
    blender --background --factory-startup --python-exit-code 1 --python bench/data/fluid_scene.py -- \
      "$set_name" "$nodes" "$frames" "$folder" >"$folder/blender.log" || {
      tail "$folder/blender.log" >&2
      exit 1
    }
    ;;
  *)
    usage >&2
    exit 2
    ;;
esac
echo "$folder/set.json"
