# SPDX-License-Identifier: Apache-2.0
# Facewright: multi-resolution 3D morphable face models.
"""Reads eos files by the bytes, as cereal lays them out, and compares every number with what the model holds.

usage: read_eos.py FOLDER    (filled by make_model_files)
"""
import json
import os
import struct
import sys


class Bytes:
    def __init__(self, path):
        with open(path, "rb") as file:
            self.data, self.at = file.read(), 0

    def take(self, form):
        values = struct.unpack_from("<" + form, self.data, self.at)
        self.at += struct.calcsize("<" + form)
        return values

    def one(self, form):
        return self.take(form)[0]

    def text(self):
        return self.take(f"{self.one('Q')}s")[0].decode()

    def matrix(self):  # int32 rows, int32 columns, float32 by columns
        rows, columns = self.take("ii")
        return (rows, columns), list(self.take(f"{rows * columns}f"))

    def triples(self):
        return list(self.take(f"{3 * self.one('Q')}i"))

    def pca(self):
        (rows, one), mean = self.matrix()
        shape, basis = self.matrix()
        (modes, _), eigenvalues = self.matrix()
        assert one == 1 and shape == ((rows, modes) if rows else (0, 0)), (rows, one, shape, modes)
        return {"mean": mean, "basis": basis, "eigenvalues": eigenvalues, "triangles": self.triples()}

    def blendshapes(self):
        return {self.text(): self.matrix()[1] for _ in range(self.one("Q"))}


def read(path):
    b = Bytes(path)
    model = {"version": b.one("I"), "shape": b.pca(), "colour": b.pca()}
    if model["version"] >= 2 and b.one("B") == 0:
        model.update({"expression": b.pca()} if b.one("i") == 0 else {"blendshapes": b.blendshapes()})
    if model["version"] >= 3 and b.one("B") == 0:
        model["landmarks"] = {b.text(): b.one("i") for _ in range(b.one("Q"))}
    model["uv"] = list(b.take(f"{2 * b.one('Q')}d"))
    if model["version"] >= 4:
        assert b.triples() == [], "texture coordinates are per vertex"
    assert b.at == len(b.data), f"{len(b.data) - b.at} bytes are left over"
    if not model["colour"]["mean"]:  # no colours: 32 bytes
        assert model.pop("colour") == {"mean": [], "basis": [], "eigenvalues": [], "triangles": []}
    return model


def main(folder):
    for name in ("version1", "version4", "blendshapes4"):
        with open(os.path.join(folder, name + ".json"), encoding="utf-8") as file:
            expected = json.load(file)
        found = read(os.path.join(folder, name + ".bin"))
        assert found.keys() == expected.keys(), (name, found.keys() ^ expected.keys())
        for part in expected:
            assert found[part] == expected[part], f"{name}.bin: {part} differs"
        print(f"{name}.bin: version {found['version']}, {', '.join(found)}: every byte read, every number equal")
    alone = Bytes(os.path.join(folder, "blendshapes_alone.bin"))
    shapes = alone.blendshapes()
    assert alone.at == len(alone.data)
    inside = read(os.path.join(folder, "blendshapes4.bin")).get("blendshapes", {})
    assert shapes == inside, "the blendshapes file differs"
    print(f"blendshapes_alone.bin: {', '.join(shapes) or 'none'}")


main(sys.argv[1])
