#!/usr/bin/env bash
# Renders the manifests and holds them against Kubernetes' own schemas, strictly, for an old and the newest
# version that the schemas are to be had for; and the programs' options in them against the programs in BIN.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$here/../..
bin=${1:-$root/target/debug}
cache=$root/target/kubernetes

skip() {
    echo "kubernetes: skipped: $*"
    exit 0
}
command -v kubectl >/dev/null || skip 'no kubectl'
validate=$cache/bin/kubernetes-validate
if [ ! -x "$validate" ]; then
    python3 -m venv "$cache" >/dev/null 2>&1 || skip 'cannot make a virtual environment of Python'
    "$cache/bin/pip" install --quiet kubernetes-validate==1.37.0 || skip 'cannot install kubernetes-validate'
fi

rendered=$cache/rendered.yaml
kubectl kustomize "$here" >"$rendered"
for version in 1.29.0 1.37.0; do
    "$validate" --strict --quiet --kubernetes-version "$version" "$rendered"
done
# the schemas are strict indeed: a field of which Kubernetes knows nothing is refused
sed 's/^\( *\)minReplicas:/\1leastReplicas: 1\n&/' "$rendered" >"$cache/wrong.yaml"
if "$validate" --strict --quiet "$cache/wrong.yaml" >/dev/null 2>&1; then
    echo 'kubernetes: FAILED: an unknown field passes' >&2
    exit 1
fi
"$cache/bin/python" - "$rendered" "$bin" <<'END'
"""Options that the programs know, references that lead somewhere, and selectors that select."""
import subprocess
import sys

import yaml

with open(sys.argv[1], encoding="utf-8") as file:
    objects = [o for o in yaml.safe_load_all(file) if o]
by_name = {(o["kind"], o["metadata"]["name"]): o for o in objects}
pods = {n: o["spec"]["template"] for (k, n), o in by_name.items() if k in ("StatefulSet", "Deployment")}
for name, pod in pods.items():
    for container in pod["spec"]["containers"]:
        program, *options = container["command"]
        # an option that is not known is an error, before help is given
        subprocess.run([f"{sys.argv[2]}/{program}", *options, "--help"], check=True, stdout=subprocess.DEVNULL)
        volumes = {v["name"] for v in pod["spec"].get("volumes", [])}
        claims = {c["metadata"]["name"] for c in by_name.get(("StatefulSet", name), {"spec": {}})["spec"].get("volumeClaimTemplates", [])}
        mounts = {m["name"] for m in container["volumeMounts"]}
        assert mounts == volumes | claims, f"{name}: mounts {mounts}, volumes {volumes | claims}"
labels = [pod["metadata"]["labels"] for pod in pods.values()]
selected = 0
for (kind, name), o in by_name.items():
    spec = o.get("spec", {})
    selector = spec["selector"] if kind == "Service" else (spec.get("selector") or spec.get("podSelector") or {}).get("matchLabels")
    if selector:
        hits = sum(selector.items() <= of_pod.items() for of_pod in labels)
        assert hits == 1, f"{kind} {name} selects {hits} of the pods"
        selected += 1
    if kind == "HorizontalPodAutoscaler":
        target = spec["scaleTargetRef"]
        assert (target["kind"], target["name"]) in by_name, f"{name} scales {target}"
assert selected >= 8, selected
print(f"kubernetes: {len(objects)} objects are valid, {selected} selectors select, options are known")
END
