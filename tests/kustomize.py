"""The part of kustomize that deploy/kubernetes uses: bases, generators, patches and images of a folder.

Names of generated objects get no digest here, which `kubectl kustomize` adds to a name and to everything that has it.
A field that is not done here is refused, so nothing is passed over.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

Thing = dict[str, Any]

KEYS = {
    "containers": "name", "initContainers": "name", "volumes": "name", "env": "name", "volumeMounts": "mountPath",
}  # fmt: skip
"""The lists that a strategic merge merges, and the field by which their elements are the same. Others are replaced."""
FIELDS = {
    "apiVersion", "kind", "namespace", "resources", "configMapGenerator", "secretGenerator", "generatorOptions",
    "patches", "images",
}  # fmt: skip
GENERATED = {"name", "literals", "files", "behavior"}


def build(folder: Path) -> list[Thing]:
    """Return the objects of a kustomization, bases first.

    Raises
    ------
    ValueError
        If it names something that does not exist, or has a field that is not known here.
    """
    told = yaml.safe_load((folder / "kustomization.yaml").read_text())
    _only(told, FIELDS, folder)
    objects = [each for name in told.get("resources", []) for each in _resource(folder, name)]
    for kind, field in (("ConfigMap", "configMapGenerator"), ("Secret", "secretGenerator")):
        for generator in told.get(field, []):
            _generate(objects, kind, generator, folder)
    for patch in told.get("patches", []):
        _only(patch, {"patch", "path"}, folder)
        _patch(
            objects, yaml.safe_load(patch["patch"] if "patch" in patch else _file(folder, patch["path"]).read_text())
        )
    for container in containers_of(objects):
        for image in told.get("images", []):
            _only(image, {"name", "newName", "newTag"}, folder)
            if container["image"] == image["name"]:
                container["image"] = f"{image.get('newName', image['name'])}:{image['newTag']}"
    if "namespace" in told:
        for each in objects:
            if each["kind"] != "Namespace":
                each["metadata"]["namespace"] = told["namespace"]
    return objects


def containers_of(objects: list[Thing]) -> Iterator[Thing]:
    """Yield the containers of some objects, those that run first included."""
    for pod in pods_of(objects).values():
        yield from (*pod["spec"].get("initContainers", []), *pod["spec"]["containers"])


def pods_of(objects: list[Thing]) -> dict[str, Thing]:
    """Return the templates of the pods of some objects, by the name of their object."""
    return {
        each["metadata"]["name"]: each["spec"]["template"] for each in objects if "template" in each.get("spec", {})
    }


def _resource(folder: Path, name: str) -> list[Thing]:
    path = folder / name
    return build(path.resolve()) if path.is_dir() else list(yaml.safe_load_all(_file(folder, name).read_text()))


def _file(folder: Path, name: str) -> Path:
    path = (folder / name).resolve()
    if not path.is_file() or not path.is_relative_to(folder.resolve()):  # kustomize reads no file outside
        raise ValueError(f"{folder}: expected a file in this folder, got {name}")
    return path


def _only(told: Thing, known: set[str], folder: Path) -> None:
    if unknown := set(told) - known:
        raise ValueError(f"{folder}: fields that are not known here: {sorted(unknown)}")


def _generate(objects: list[Thing], kind: str, generator: Thing, folder: Path) -> None:
    _only(generator, GENERATED, folder)
    pairs = [literal.split("=", 1) for literal in generator.get("literals", [])]
    for text in generator.get("files", []):
        key, _, name = text.rpartition("=")
        pairs.append((key or Path(name).name, _file(folder, name).read_text()))
    if generator.get("behavior", "create") == "merge":
        _find(objects, kind, generator["name"])["data"].update(pairs)
    else:
        objects.append({"apiVersion": "v1", "kind": kind, "metadata": {"name": generator["name"]}, "data": dict(pairs)})


def _find(objects: list[Thing], kind: str, name: str) -> Thing:
    found = [each for each in objects if each["kind"] == kind and each["metadata"]["name"] == name]
    if len(found) != 1:
        raise ValueError(f"expected one {kind} {name}, got {len(found)}")
    return found[0]


def _patch(objects: list[Thing], patch: Thing) -> None:
    found = _find(objects, patch["kind"], patch["metadata"]["name"])
    if patch.get("$patch") == "delete":
        objects.remove(found)
    else:
        _merge(found, patch)


def _merge(into: Thing, patch: Thing) -> None:
    for name, value in patch.items():
        if value is None:
            into.pop(name, None)
        elif isinstance(value, dict) and isinstance(into.get(name), dict):
            _merge(into[name], value)
        elif name in KEYS and name in into:
            _merge_list(into[name], value, KEYS[name])
        else:
            into[name] = copy.deepcopy(value)


def _merge_list(into: list[Thing], patch: list[Thing], key: str) -> None:
    for value in patch:
        same = next((each for each in into if each[key] == value[key]), None)
        if same is None:
            into.append(copy.deepcopy(value))
        else:
            _merge(same, value)
