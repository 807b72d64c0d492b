#!/usr/bin/env bash
# A list of distinct items in a multipart form makes a Java client that does not compile, and lists that are left out of a
# form end its calls.
#
# Versions: openapi-generator 7.26.0 (PyPI openapi-generator-cli 7.26.0), generator java, library native.
# Seen: an optional array of a multipart/form-data body is read by `for (i < name.size()) ... name.get(i)` without a look whether
# it is null, so that leaving it out is a NullPointerException. With uniqueItems the parameter is a Set, which has no get(i): the
# generated source does not compile. Neither is told when the client is made; in a query the same arrays are handled rightly.
# Rule: no uniqueItems on arrays of forms (say it in words, and refuse doubles); callers in Java give empty lists.
#
# Needs python3 with venv and pip, and java 11 or newer. Fails where the behaviour changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"

python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check openapi-generator-cli==7.26.0
cat > form.json <<'JSON'
{"openapi": "3.1.0", "info": {"title": "t", "version": "1"},
 "paths": {"/": {"post": {"operationId": "send", "tags": ["try"],
   "requestBody": {"required": true, "content": {"multipart/form-data": {"schema": {"type": "object", "required": ["file"],
     "properties": {"file": {"type": "string", "format": "binary"},
       "plain": {"type": "array", "items": {"type": "integer", "format": "int64"}},
       "distinct": {"type": "array", "uniqueItems": true, "items": {"type": "integer", "format": "int64"}}}}}}},
   "responses": {"200": {"description": "d", "content": {"application/json": {"schema": {"type": "object"}}}}}}}}}
JSON
venv/bin/openapi-generator-cli generate -i form.json -g java --library native -o java > log 2>&1
source=$(find java/src/main -name TryApi.java)
set_parameter=$(grep -cE 'Set<Long> distinct' "$source" || true)
by_index=$(grep -cF 'distinct.get(i)' "$source" || true)
unguarded=$(grep -B1 -F 'for (int i=0; i < plain.size(); i++)' "$source" | grep -cF 'plain != null' || true)
echo "distinct is a Set in $set_parameter places and read by index in $by_index; loops over plain behind a look for null: $unguarded"
if [ "$set_parameter" -gt 0 ] && [ "$by_index" -gt 0 ] && [ "$unguarded" = 0 ]; then
    echo "as seen"
else
    echo "the behaviour has changed" >&2
    exit 1
fi
