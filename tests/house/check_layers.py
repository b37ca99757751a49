# SPDX-License-Identifier: Apache-2.0
# Facewright: multi-resolution 3D morphable face models.
"""Fails on an include that breaks the layer table, and on a public header that shows more than Eigen and std.

usage: check_layers.py SOURCE_DIR
"""
import os
import re
import sys

# module -> modules it may include besides itself. docs/architecture.md shows the same table.
LAYERS = {
    "libmodel/core": [],
    "libmodel/io": ["core"],
    "libmodel/geometry": ["core"],
    "libmodel/surface": ["core", "geometry"],
    "libmodel/render": ["core", "geometry"],
    "libmodel/model": ["core", "io"],
    "libmodel/fitting": ["core", "geometry", "render", "model"],
    "libmodel/building": ["core", "geometry", "surface", "model"],
    "libmodel/uv": ["core", "geometry", "surface"],
    "libmodel/interop": ["core", "io", "geometry", "render", "model"],
    "libmodel/synthetic": ["core", "geometry", "surface", "render"],
    "libregister/subdivision": ["core"],
    "libregister/reference": ["core", "geometry", "surface", "subdivision"],
    "libregister/intake": ["core", "io", "geometry", "surface"],
    "libregister/landmarking": ["core", "geometry", "surface", "render", "registration"],
    "libregister/registration": ["core", "geometry", "surface", "subdivision"],
}
PLACE = {name.split("/")[1]: name for name in LAYERS}
FITTING = ["core", "io", "geometry", "render", "model", "fitting"]  # a program that only fits links nothing heavy
HEAVY = re.compile(r"^(CGAL|OpenMesh|flann|assimp|Spectra|boost)/")
STANDARD = re.compile(r"^[a-z_]+$")  # <vector>, <cstdint>: no folder, no extension
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.M)
OWN = ("libmodel/", "libregister/", "pipelines/", "tools/", "tests/")


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def allowed_folders(folder):
    if folder == "pipelines":
        return list(LAYERS) + ["pipelines"]
    return [PLACE[name] for name in LAYERS[folder]] + [folder]


def public_headers(source_dir, folder):
    """The headers a module's CMakeLists.txt lists after HEADERS."""
    path = os.path.join(source_dir, folder, "CMakeLists.txt")
    if not os.path.exists(path):
        return set()
    text = re.sub(r"#.*", "", read(path))
    names = set()
    for block in re.findall(r"\bHEADERS\b(.*?)(?=\bSOURCES\b|\bLINK\b|\bPRIVATE_LINK\b|\))", text, re.S):
        names.update(os.path.normpath(os.path.join(folder, word)) for word in block.split())
    return names


def check_own_include(folder, target):
    if not target.startswith(OWN):
        return "quote only own headers, by their path from the root of the tree"
    place = os.path.dirname(target)
    if place not in allowed_folders(folder) and not (folder == "pipelines" and place.startswith("pipelines/")):
        return f"{folder} may include only {', '.join(allowed_folders(folder))}"
    return None


def check_system_include(folder, target, is_public):
    if is_public and not (target.startswith("Eigen/") or STANDARD.match(target)):
        return "a public header shows Eigen and std only; move this into the .cpp file"
    if HEAVY.match(target) and os.path.basename(folder) in FITTING:
        return "the fitting library links no CGAL, OpenMesh, FLANN, Spectra, assimp or Boost"
    return None


def problems(source_dir):
    found = []
    for folder in list(LAYERS) + ["pipelines"]:
        public = public_headers(source_dir, folder)
        for place, _, files in os.walk(os.path.join(source_dir, folder)):
            for name in sorted(files):
                if not name.endswith((".h", ".cpp", ".inc")):
                    continue
                path = os.path.relpath(os.path.join(place, name), source_dir)
                text = read(os.path.join(source_dir, path))
                for match in INCLUDE.finditer(text):
                    bracket, target = match.groups()
                    reason = (check_own_include(folder, target) if bracket == '"'
                              else check_system_include(folder, target, path in public))
                    if reason:
                        line = text.count("\n", 0, match.start(1)) + 1
                        found.append(f"{path}:{line}: includes {target}: {reason}")
    return found


if __name__ == "__main__":
    messages = problems(sys.argv[1])
    print("\n".join(messages) or "all includes keep to the layers")
    sys.exit(1 if messages else 0)
