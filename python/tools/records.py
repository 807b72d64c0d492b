#!/usr/bin/env python3
"""Makes conicoid/records.py from the contract: `python tools/records.py` writes it, with `--print` to standard output."""

from __future__ import annotations

import json
import sys
import textwrap
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
CONTRACT = HERE.parent.parent / "proto" / "openapi.json"
TARGET = HERE.parent / "conicoid" / "records.py"

#: What the package itself has under other names, or not at all.
LEFT_OUT = {"Problem"}
#: The methods of `Record`, which fields may not hide.
METHODS = {"get", "items", "keys", "to_dict", "values"}
HEAD = '''"""The objects of an answer, as the contract of the service describes them.

Made by tools/records.py; not to be changed by hand. Lengths are in the input's unit, angles in radians.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypedDict, Union

import numpy as np
import numpy.typing as npt

from .record import Record

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

FloatArray = npt.NDArray[np.float64]
'''


def reference(schema: dict[str, Any]) -> str | None:
    target = schema.get("$ref")
    return target.rsplit("/", 1)[1] if target else None


class Contract:
    def __init__(self, document: dict[str, Any]) -> None:
        self.schemas: dict[str, Any] = document["components"]["schemas"]
        self.document = document

    def parameters(self, path: str) -> list[dict[str, Any]]:
        """What a request to `path` may say."""
        operation = self.document["paths"][path]["post"]
        parameters = [self.resolved(p, self.document) for p in operation["parameters"]]
        return [p for p in parameters if p["in"] == "query"]

    @staticmethod
    def resolved(parameter: dict[str, Any], document: dict[str, Any]) -> dict[str, Any]:
        name = reference(parameter)
        return document["components"]["parameters"][name] if name else parameter

    def is_enum(self, name: str) -> bool:
        schema = self.schemas[name]
        options = schema.get("oneOf", [])
        return "enum" in schema or bool(options) and all("enum" in o or "const" in o for o in options)

    def classes(self, schema: dict[str, Any]) -> list[str]:
        """The classes that an object behind this schema may be of."""
        name = reference(schema)
        if name:
            inner = self.schemas[name]
            if self.is_enum(name):
                return []
            return self.classes(inner) if "oneOf" in inner else [name]
        found: list[str] = []
        for part in [*schema.get("oneOf", []), *schema.get("anyOf", []), *schema.get("allOf", [])]:
            found += self.classes(part)
        if "items" in schema:
            found += self.classes(schema["items"])
        return found

    def type(self, schema: dict[str, Any], *, is_input: bool = False) -> str:
        """The annotation for this schema."""
        name = reference(schema)
        if name:
            return name
        parts = [*schema.get("oneOf", []), *schema.get("anyOf", []), *schema.get("allOf", [])]
        if parts:
            return " | ".join(dict.fromkeys(self.type(part, is_input=is_input) for part in parts))
        if "enum" in schema:
            return f"Literal[{', '.join(json.dumps(word) for word in schema['enum'])}]"
        kinds = schema.get("type", "object")
        kinds = kinds if isinstance(kinds, list) else [kinds]
        return " | ".join(self.kind(kind, schema, is_input) for kind in kinds)

    def kind(self, kind: str, schema: dict[str, Any], is_input: bool) -> str:
        if kind == "array":
            items = schema.get("items", {})
            if is_input:
                # objects may be given as plain dictionaries
                inner = "Mapping[str, Any]" if self.classes(items) else self.type(items, is_input=True)
                return f"Sequence[{inner}] | str"
            return "FloatArray" if self.is_floats(items) else f"list[{self.type(items)}]"
        if kind == "object":
            values = schema.get("additionalProperties")
            return f"dict[str, {self.type(values)}]" if isinstance(values, dict) else "dict[str, Any]"
        names = {"string": "str", "integer": "int", "number": "float", "boolean": "bool"}
        return {**names, "null": "None"}[kind]

    def is_floats(self, schema: dict[str, Any]) -> bool:
        if schema.get("type") == "array":
            return self.is_floats(schema.get("items", {}))
        return schema.get("type") == "number"

    def written(self) -> str:
        text = [HEAD]
        enums = [name for name in self.schemas if self.is_enum(name)]
        for name in enums:
            schema = self.schemas[name]
            words = schema.get("enum") or [o.get("const") or o["enum"][0] for o in schema["oneOf"]]
            union = ", ".join(json.dumps(word) for word in words)
            text.append(f"{name} = Literal[{union}]\n")
        for name, schema in self.schemas.items():
            if name not in LEFT_OUT and name not in enums and not self.is_union(name):
                text.append(self.record(name, schema))
        for name in self.schemas:
            if self.is_union(name):
                text.append(f"{name} = Union[{', '.join(self.classes(self.schemas[name]))}]\n")
        text.append(self.keywords("Keywords", "segment", "/v1/segmentations"))
        text.append(self.keywords("FitKeywords", "fit", "/v1/fits"))
        return "\n\n".join(part.strip("\n") for part in text) + "\n"

    def is_union(self, name: str) -> bool:
        return "oneOf" in self.schemas[name] and not self.is_enum(name)

    def record(self, name: str, schema: dict[str, Any]) -> str:
        """One class; what other objects are flattened into it are parts of it by their names."""
        own, parts = schema, []
        if "allOf" in schema:
            parts = [reference(part) for part in schema["allOf"] if reference(part)]
            own = next(part for part in schema["allOf"] if "properties" in part)
        properties: dict[str, Any] = own.get("properties", {})
        every = dict(properties)
        for part in parts:
            every.update(self.schemas[str(part)]["properties"])
        lines = [f"class {name}(Record):", docstring(schema.get("description") or own.get("description") or name)]
        lines.append("    _fields: ClassVar[dict[str, tuple[str, ...]]] = {")
        for field, inner in every.items():
            lines.append(f"        {field!r}: {tuple(self.classes(inner))!r},".replace("'", '"'))
        lines += ["    }", ""]
        lists = tuple(field for field, inner in every.items() if inner.get("type") == "array")
        if lists:
            lines += [f"    _lists: ClassVar[frozenset[str]] = frozenset({lists!r})".replace("'", '"'), ""]
        lines.append("    if TYPE_CHECKING:")
        for field, inner in every.items():
            # what may be null may be absent, a list that is absent is empty, and all else is there
            lines += ["", f"        {attribute(field)}: {self.type(inner)}"]
            told = inner.get("description") or next(
                (o["description"] for o in inner.get("oneOf", []) if "description" in o), None
            )
            if told:
                lines.append(textwrap.indent(docstring(told), "    "))
        for part in parts:
            method = str(part).lower()
            lines += [
                "",
                "    @property",
                f"    def {method}(self) -> {part}:",
                f'        """Those of its fields that are of `{part}`, by themselves."""',
                f"        return {part}({{k: v for k, v in self._data.items() if k in {part}._fields}})",
            ]
        return "\n".join(lines)

    def keywords(self, name: str, function: str, path: str) -> str:
        lines = [
            f"class {name}(TypedDict, total=False):",
            docstring(f"The parameters and options that `{function}` takes; those that are None are left out."),
        ]
        for parameter in self.parameters(path):
            annotation = self.type(parameter["schema"], is_input=True)
            lines += ["", f"    {parameter['name']}: {annotation} | None"]
            lines.append(docstring(parameter.get("description", "")))
        return "\n".join(lines)


def attribute(field: str) -> str:
    """The attribute of a field: that of one that is called like a method ends in an underscore."""
    return f"{field}_" if field in METHODS else field


def docstring(text: str) -> str:
    text = " ".join(text.split()).replace("\\", "\\\\").replace('"', "'")
    lines = textwrap.wrap(text, 108)
    return textwrap.indent('"""' + "\n".join(lines) + ("\n" if len(lines) > 1 else "") + '"""', "    ")


def made() -> str:
    return Contract(json.loads(CONTRACT.read_text())).written()


if __name__ == "__main__":
    if "--print" in sys.argv:
        sys.stdout.write(made())
    else:
        TARGET.write_text(made())
