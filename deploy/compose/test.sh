#!/usr/bin/env bash
# Builds the image, brings the compose file up on a real Docker engine, and solves through the published port:
# the same bytes as in process, with one worker's container killed and another cut off its network amid the
# solve. BIN is the folder of the programs. Where no image of Debian can be had, one is made with debootstrap.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
bin=$(cd "${1:-$root/target/debug}" && pwd)
cache=$root/target/compose

skip() {
    echo "compose: skipped: $*"
    exit 0
}
say() { printf 'compose: %s\n' "$*"; }
docker info >/dev/null 2>&1 || skip 'no Docker engine answers'
if docker compose version >/dev/null 2>&1; then
    compose=(docker compose)
elif command -v docker-compose >/dev/null; then
    compose=(docker-compose)
else
    skip 'no docker compose'
fi

mkdir -p "$cache"
base=debian:bookworm-slim
has_image() { docker image inspect "$1" >/dev/null 2>&1; }
if ! has_image "$base" && ! timeout 60 docker pull --quiet "$base" >/dev/null 2>&1; then
    base=nestrad-debian:bookworm
fi
if [ "$base" = nestrad-debian:bookworm ] && ! has_image "$base"; then
    if [ ! -e "$cache/base.tar" ]; then
        say 'no registry answers: making a Debian base with debootstrap'
        [ "$(id -u)" -eq 0 ] || skip 'only root can run debootstrap'
        command -v debootstrap >/dev/null || { apt-get update -qq && apt-get install -y -qq --no-install-recommends \
            debootstrap; } >/dev/null 2>&1 || skip 'cannot install debootstrap'
        # this machine's own source of Debian packages
        mirror=$(sed -nE 's/^(URIs:|deb( \[[^]]*\])?) *(https?:[^ ]*).*/\3/p' /etc/apt/sources.list \
            /etc/apt/sources.list.d/debian.sources 2>/dev/null | head -n 1) || true
        [ -n "$mirror" ] || skip 'no source of Debian packages'
        rm -rf "$cache/root"
        debootstrap --variant=minbase --include=ca-certificates,curl bookworm "$cache/root" "$mirror" \
            >"$cache/debootstrap.log" 2>&1 || skip "debootstrap fails: $(tail -n 1 "$cache/debootstrap.log")"
        rm -rf "$cache"/root/{var/cache/apt,var/lib/apt/lists,usr/share/doc,usr/share/man,usr/share/locale}/*
        tar -C "$cache/root" -cf "$cache/base.partial" .
        mv "$cache/base.partial" "$cache/base.tar"
        rm -rf "$cache/root"
    fi
    docker import "$cache/base.tar" "$base" >/dev/null
fi

work=$(mktemp -d)
export COMPOSE_PROJECT_NAME=nestrad-test-$$ NESTRAD_IMAGE=nestrad:test-$$ NESTRAD_PORT=0 NESTRAD_LEASE_S=5
export NESTRAD_MEMORY_GIB=2 NESTRAD_MASTER_LIMIT=4g NESTRAD_WORKER_LIMIT=1g NESTRAD_WORKER_GIB=0.75
export NESTRAD_CLIENT_TOKEN=$work/client.token NESTRAD_WORKER_TOKEN=$work/worker.token
unset NESTRAD_TOKEN
compose+=(-f "$here/compose.yaml")
solve=
down() {
    if [ -n "$solve" ]; then kill "$solve" 2>/dev/null || true; fi
    "${compose[@]}" down --volumes --timeout 5 >/dev/null 2>&1 || true
    docker image rm "$NESTRAD_IMAGE" >/dev/null 2>&1 || true
    rm -rf "$work"
}
trap down EXIT
fail() {
    say "FAILED: $*"
    "${compose[@]}" logs --tail=40 2>&1 || true
    cat "$work"/*.log 2>/dev/null || true
    exit 1
}
# until CONDITION holds, for a bounded time: within SECONDS WHAT CONDITION...
within() {
    local until=$((SECONDS + $1)) what=$2
    shift 2
    until "$@"; do
        [ "$SECONDS" -lt "$until" ] || fail "no $what in time"
        sleep 0.2
    done
}

mkdir -p "$work/context/programs" "$work/context/deploy"
cp -r "$root/deploy/docker" "$work/context/deploy/docker"
for program in nestrad nestrad-worker; do strip -o "$work/context/programs/$program" "$bin/$program"; done
docker build --quiet --target given --build-arg "DEBIAN=$base" -t "$NESTRAD_IMAGE" \
    -f "$work/context/deploy/docker/Dockerfile" "$work/context" >/dev/null 2>"$work/build.log" || fail 'no image'
say "image of $(($(docker image inspect --format '{{.Size}}' "$NESTRAD_IMAGE") / 1000000)) MB"

openssl rand -hex 32 >"$NESTRAD_CLIENT_TOKEN"
openssl rand -hex 32 >"$NESTRAD_WORKER_TOKEN"
chmod 0444 "$work"/*.token
chmod 0711 "$work"
"${compose[@]}" up -d --scale worker=3 >"$work/up.log" 2>&1 || fail 'compose up'
master=$("${compose[@]}" ps -q master)
healthy() { [ "$(docker inspect --format '{{.State.Health.Status}}' "$master")" = healthy ]; }
within 60 'healthy master' healthy
url=http://$(docker port "$master" 7410/tcp | head -n 1)
say "a master and three workers are up at $url"
case $url in http://127.0.0.1:*) ;; *) fail 'published beyond the loopback' ;; esac

cd "$work"
"$bin/nestrad" generate maize --rows 2x4 --leaf-triangle 2e-4 --out scene >/dev/null
options=(--accuracy 0.3 --memory 2)
"$bin/nestrad" solve scene/scene.toml --out expected --quiet "${options[@]}" >/dev/null
if "$bin/nestrad" solve scene/scene.toml --out refused --quiet --master "$url" \
    --token-file "$NESTRAD_WORKER_TOKEN" "${options[@]}" >/dev/null 2>&1; then
    fail 'a worker may solve'
fi

"$bin/nestrad" solve scene/scene.toml --out out --master "$url" --token-file "$NESTRAD_CLIENT_TOKEN" \
    "${options[@]}" >solve.log 2>&1 &
solve=$!
mapfile -t workers < <("${compose[@]}" ps -q worker)
[ "${#workers[@]}" -eq 3 ] || fail "${#workers[@]} workers, not three"
computing() {
    local worker
    for worker in "${workers[@]}"; do docker logs "$worker" 2>&1 | grep -q 'block is ready' || return; done
}
within 60 'three workers at work' computing
docker kill --signal KILL "${workers[0]}" >/dev/null
docker network disconnect --force "${COMPOSE_PROJECT_NAME}_inside" "${workers[1]}"
kill -0 "$solve" 2>/dev/null || fail 'the solve was over before its workers were lost'
[ ! -e out ] || fail 'the solve was over before its workers were lost'
code=0
timeout 120 tail --pid="$solve" -f /dev/null || fail 'no end of the solve in time'
wait "$solve" || code=$?
solve=
[ "$code" -eq 0 ] || fail "the solve ended with $code"
for table in organs.csv triangles.csv; do
    cmp "expected/$table" "out/$table" || fail "$table differs from the solve in process"
done
say 'a worker killed and one cut off amid the solve: the same bytes as in process'
"${compose[@]}" stop --timeout 45 master >/dev/null 2>&1
code=$(docker inspect --format '{{.State.ExitCode}}' "$master")
[ "$code" -eq 0 ] || fail "the master that was told to stop ended with $code"
