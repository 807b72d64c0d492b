#!/usr/bin/env bash
# Makes a release in dist/: the binary, the list of what is in it (SBOM, CycloneDX), the wheel of the Python package,
# digests, and the image.
#
#   deploy/release.sh [--no-tests] [--no-image] [IMAGE]
#
# IMAGE is the image's name without a tag, such as registry.example/conicoid (default: conicoid); it gets the
# tags VERSION and MAJOR.MINOR of Cargo.toml's version. Nothing is pushed: the last lines say how.
#
# Needs: git with a clean tree, Rust, Python, cargo-sbom (cargo install --locked cargo-sbom), and docker for the image,
# which fetches the base images that the Dockerfile names.
set -euo pipefail
cd "$(dirname "$0")/.."

tests=yes image=yes name=conicoid
for argument in "$@"; do
    case $argument in
        --no-tests) tests=no ;;
        --no-image) image=no ;;
        -*) echo "unknown flag $argument; known ones: --no-tests, --no-image" >&2; exit 2 ;;
        *) name=$argument ;;
    esac
done

fail() { echo "release: $*" >&2; exit 1; }
needs() { command -v "$1" >/dev/null || fail "$1 is missing: $2"; }

# everything that could be missing is told before the first minute of work
needs git "install it"
needs cargo "see https://rustup.rs"
needs python3 "install it, with its venv"
needs cargo-sbom "cargo install --locked cargo-sbom"
[ "$image" = no ] || needs docker "install it, or leave the image out with --no-image"
[ -z "$(git status --porcelain)" ] || fail "the tree has changes that are not committed"

version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -1)
grep -q "^## $version" CHANGELOG.md || fail "CHANGELOG.md has no section $version"
for file in deploy/compose.yaml deploy/kubernetes/kustomization.yaml; do
    grep -q "$version" "$file" || fail "$file names another version than $version"
done
grep -q "^version = \"$version\"" python/Cargo.toml || fail "python/Cargo.toml has another version than $version"
revision=$(git rev-parse HEAD)

[ "$tests" = no ] || tests/run

target=$(rustc -vV | sed -n 's/^host: //p')
release=conicoid-$version-$target
rm -rf dist
mkdir -p "dist/$release"
cargo build --release --locked --bin conicoid
cp target/release/conicoid LICENSE README.md CHANGELOG.md deploy/conicoid.toml "dist/$release/"
strip "dist/$release/conicoid"
"dist/$release/conicoid" --version | grep -qx "conicoid $version" || fail "the binary is of another version"

# without what only tests are built with
cargo sbom --cargo-package conicoid --output-format cyclone_dx_json_1_6 > "dist/$release.cdx.json"
cp "dist/$release.cdx.json" "dist/$release/sbom.cdx.json"

# the same tree gives the same archive
tar --sort=name --owner=0 --group=0 --numeric-owner --mtime="@$(git log -1 --format=%ct)" \
    -C dist -cf - "$release" | gzip -n > "dist/$release.tar.gz"
rm -r "dist/$release"

python/build dist

if [ "$image" = yes ]; then
    docker build --pull -t "$name:$version" -t "$name:${version%.*}" \
        --label org.opencontainers.image.version="$version" \
        --label org.opencontainers.image.revision="$revision" \
        --label org.opencontainers.image.licenses=Apache-2.0 .
    docker image inspect --format '{{.Id}}' "$name:$version" > "dist/$release.image"
fi
(cd dist && sha256sum -- * > SHA256SUMS)

echo "dist/ holds conicoid $version of $revision:"
ls -l dist
[ "$image" = no ] || echo "docker push $name:$version; then pin its digest where it is deployed"
