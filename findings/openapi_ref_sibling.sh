#!/usr/bin/env bash
# A description beside a $ref, which OpenAPI 3.1 allows, makes a TypeScript client that does not compile.
#
# Versions: openapi-generator 7.26.0 (PyPI openapi-generator-cli 7.26.0), generator typescript-fetch.
# Seen: where each $ref of a oneOf has a description beside it, the model of the choice imports none of its members, and
# every answer with one ends in a ReferenceError. The same document without the descriptions gives a client with all imports.
# The generator says nothing in either case, and the document is valid in both.
# Rule: write nothing beside a $ref; words about a reference stand in an allOf around it.
#
# Needs python3 with venv and pip, and java 11 or newer. Fails where the behaviour changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"

python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check openapi-generator-cli==7.26.0
imports() { # NAME BESIDE: how many members the model of the choice imports
    cat > "$1.json" <<JSON
{"openapi": "3.1.0", "info": {"title": "t", "version": "1"},
 "paths": {"/": {"get": {"operationId": "get", "responses": {"200": {"description": "d",
   "content": {"application/json": {"schema": {"\$ref": "#/components/schemas/Either"}}}}}}}},
 "components": {"schemas": {
   "Either": {"oneOf": [{"\$ref": "#/components/schemas/Ball"$2}, {"\$ref": "#/components/schemas/Cube"$2}]},
   "Ball": {"type": "object", "required": ["radius"], "properties": {"radius": {"type": "number"}}},
   "Cube": {"type": "object", "required": ["side"], "properties": {"side": {"type": "number"}}}}}}
JSON
    venv/bin/openapi-generator-cli generate -i "$1.json" -g typescript-fetch -o "$1" > "$1.log" 2>&1
    grep -cE "^import .*(Ball|Cube)" "$1/models/Either.ts" || true
}
beside=$(imports beside ', "description": "a form"')
alone=$(imports alone '')
echo "imports with descriptions beside \$ref: $beside, without: $alone"
if [ "$beside" = 0 ] && [ "$alone" -gt 0 ]; then
    echo "as seen"
else
    echo "the behaviour has changed" >&2
    exit 1
fi
