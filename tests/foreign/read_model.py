# SPDX-License-Identifier: Apache-2.0
# Facewright: multi-resolution 3D morphable face models.
"""h5py opens a model file and makes, at every level, the face that the model makes, by statismo's rules alone.

usage: read_model.py MODEL.h5 LEVELS.json    (the latter by make_model_files)
"""
import json
import sys

try:
    import h5py
    import numpy as np
except ImportError:
    print("skipped: there is no h5py (Debian: python3-h5py)")
    sys.exit(77)


def instance(part, coefficients):
    """What statismo 0.9 says a model is."""
    assert (part["version/majorVersion"][()], part["version/minorVersion"][()]) == (0, 9)
    mean, basis = part["model/mean"][:], part["model/pcaBasis"][:].astype(float)
    variance = part["model/pcaVariance"][:].astype(float)
    return mean + basis @ (np.sqrt(variance) * coefficients)


def layout_faults(level):
    """What readers of statismo and of the Basel Face Model stumble over."""
    faults = []
    for name in [n for n in ("shape", "color", "expression") if n in level]:
        part = level[name]
        basis = part["model/pcaBasis"][:].astype(float)
        variance = part["model/pcaVariance"][:]
        checks = {
            "orthonormal": np.abs(basis.T @ basis - np.eye(basis.shape[1])).max() < 1e-5,
            "descending": (np.diff(variance) <= 0).all() and (variance >= 0).all(),
            "float32": all(part["model/" + d].dtype == np.float32 for d in ("mean", "pcaBasis", "pcaVariance")),
            "noiseVariance (1,)": part["model/noiseVariance"].shape == (1,),
            "contiguous": all(part["model/" + d].chunks is None for d in ("mean", "pcaBasis")),
            "scalar version": part["version/minorVersion"].shape == (),
            "int32 cells (3, T)": part["representer/cells"].dtype == np.int32 and part["representer/cells"].shape[0] == 3,
            "cells below N": part["representer/cells"][:].max() < len(part["model/mean"]) // 3,
            "points (3, N)": part["representer/points"].shape == (3, len(part["model/mean"]) // 3),
            "same points": (part["representer/points"][:] == level["shape/representer/points"][:]).all(),
            "scores": part["modelinfo/scores"].ndim == 2,
            "builder": all("modelinfo/modelBuilder-0/" + d in part
                           for d in ("builderName", "buildTime", "dataInfo", "parameters")),
            "fixed strings": h5py.check_string_dtype(part["modelinfo/build-time"].dtype).length is not None,
            "representer": not bytes(part["representer"].attrs["name"]).startswith((b"vtkPoly", b"itkMeshR")),
            "catalogue": level["catalog/MorphableModel." + name + "/modelPath"][()].decode() == part.name,
        }
        faults += [f"{part.name}: {what}" for what, holds in checks.items() if not holds]
    return faults


def main():
    with open(sys.argv[2], encoding="utf-8") as file:
        expected = json.load(file)
    worst = {}
    faults = []
    with h5py.File(sys.argv[1], "r") as model:
        for group, parts in expected.items():
            faults += layout_faults(model[group])
            for name, face in parts.items():
                made = instance(model[group][name], np.array(face["coefficients"]))
                off = np.abs(made - face["values"]).max()
                worst[group + " " + name] = off
                scale = np.abs(face["values"]).max()
                if not off <= 1e-6 * scale:
                    faults.append(f"{group} {name}: off by {off:.1e} of {scale:.1e}")
    for what, off in worst.items():
        print(f"{what}: off by at most {off:.1e}")
    for fault in faults:
        print("FAILED", fault)
    return 1 if faults else 0


sys.exit(main())
