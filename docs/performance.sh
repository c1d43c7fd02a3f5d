#!/bin/sh
# Measures everything in docs/performance.md again. From the repository's root; a built photolith in PATH or in PHOTOLITH.
set -eu
photolith=${PHOTOLITH:-photolith}
bench() {
    section=$1
    shift
    echo "$section" >&2
    "$photolith" bench "$@" --plot "docs/plots/$section.svg" --markdown docs/performance.md --section "$section"
}
scenes=assets/scenes
bench samplers $scenes/spheres.toml $scenes/cornell.toml $scenes/cat.toml --size 128x128 --samples 1..64 \
    --vary sampler=sobol,independent
bench features $scenes/spheres.toml $scenes/cat.toml --size 64x64 --samples 4..16 --vary features=specialised,general
bench roulette $scenes/indirect.toml --size 96x96 --samples 4..64 --vary roulette=off,3,5,8
bench scheduler $scenes/cat.toml --size 64x64 --samples 8..32 --vary scheduler=queue,inline \
    --vary intersection=watertight,moller-trumbore
bench hierarchy $scenes/cat.toml --size 24x24 --samples 1,2,4 --seeds 3 --vary accel=bvh,none
bench triangles --growth triangles
bench spheres --growth spheres
bench lights --growth lights
bench pixels --growth pixels --samples 2
bench depth --growth depth --samples 1
