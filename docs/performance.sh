#!/bin/sh
# Measures everything in docs/measurements.md again. From the repository's root; a built photolith in PATH or in PHOTOLITH.
# A section that fails keeps its old text; the others are measured all the same, and the exit code says so.
set -u
photolith=${PHOTOLITH:-photolith}
failed=
table() {
    section=$1
    shift
    echo "$section" >&2
    "$photolith" bench "$@" --markdown docs/measurements.md --section "$section" >/dev/null || failed="$failed $section"
}
plot() {
    table "$@" --plot "docs/plots/$1.svg"
}
scenes=assets/scenes
plot samplers $scenes/spheres.toml $scenes/cornell.toml $scenes/cat.toml --size 96x96 --samples 1..64 \
    --vary sampler=sobol,independent,pcg
table features $scenes/spheres.toml $scenes/cat.toml --size 64x64 --samples 8,16 --seeds 5 \
    --vary features=specialised,+mirror,+dielectric,+emitter,+background,+smooth-normals,+bvh,+sampler-levels,general
plot roulette $scenes/indirect.toml --size 96x96 --samples 4..64 --vary roulette=off,3,5,8
plot scheduler $scenes/cat.toml --size 64x64 --samples 8..32 --vary scheduler=queue,inline --vary reuse=off \
    --vary intersection=watertight,moller-trumbore
plot reuse $scenes/cat.toml --size 96x96 --samples 4..64 --vary reuse=auto,off
plot gradients $scenes/cat.toml --size 96x96 --samples 4..64 --vary gradients=auto,off
plot light-tracing $scenes/cornell.toml --size 96x96 --samples 4..64 --vary light-tracing=auto,off
plot dual $scenes/cat.toml $scenes/cornell.toml --size 96x96 --samples 16..256 --vary sampling=uniform,dual
plot hierarchy $scenes/cat.toml --size 24x24 --samples 1,2,4 --seeds 3 --vary accel=bvh,none
table rays $scenes/cat.toml --rays
plot triangles --growth triangles --max 10000000
plot spheres --growth spheres
plot lights --growth lights
plot pixels --growth pixels --samples 2
plot depth --growth depth --samples 1
if [ -n "$failed" ]; then
    echo "failed:$failed" >&2
    exit 1
fi
