# openapi-python-client.
venv/bin/openapi-python-client generate --path openapi.json --output-path python > python.log 2>&1 || { cat python.log; exit 1; }
PYTHONPATH=python venv/bin/python "$here/try.py" "$url" cloud.xyz
