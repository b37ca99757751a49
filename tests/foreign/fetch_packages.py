# SPDX-License-Identifier: Apache-2.0
# Facewright: multi-resolution 3D morphable face models.
"""Puts the packages of package-lock.json into a node_modules folder: what `npm ci` does, without npm. Each archive must
have the checksum of the lock file. What is there already is left alone.

usage: fetch_packages.py NODE_MODULES
"""
import base64
import hashlib
import io
import json
import os
import sys
import tarfile
import urllib.request

HERE = os.path.dirname(os.path.abspath(__file__))


def fetch(name, entry, folder):
    place = os.path.join(folder, name)
    marker = os.path.join(place, ".version")
    if os.path.exists(marker) and open(marker).read() == entry["version"]:
        return
    with urllib.request.urlopen(entry["resolved"], timeout=60) as answer:
        archive = answer.read()
    kind, expected = entry["integrity"].split("-", 1)
    if base64.b64encode(hashlib.new(kind, archive).digest()).decode() != expected:
        sys.exit(f"fetch_packages: {entry['resolved']} is not what package-lock.json expects")
    with tarfile.open(fileobj=io.BytesIO(archive)) as tar:
        for member in tar.getmembers():
            path = os.path.normpath(member.name.partition("/")[2])
            if not member.isfile() or path.startswith(("..", "/")):
                continue
            target = os.path.join(place, path)
            os.makedirs(os.path.dirname(target), exist_ok=True)
            with open(target, "wb") as file:
                file.write(tar.extractfile(member).read())
    with open(marker, "w") as file:
        file.write(entry["version"])
    print(f"fetch_packages: {name} {entry['version']}")


if __name__ == "__main__":
    with open(os.path.join(HERE, "package-lock.json"), encoding="utf-8") as lock:
        packages = json.load(lock)["packages"]
    try:
        for key, value in packages.items():
            if key:
                fetch(key.removeprefix("node_modules/"), value, sys.argv[1])
    except OSError as error:
        sys.exit(f"fetch_packages: {error}; the tests that need these packages will be skipped")
