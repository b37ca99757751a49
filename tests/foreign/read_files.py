# SPDX-License-Identifier: Apache-2.0
# Facewright: multi-resolution 3D morphable face models.
"""NumPy opens both kinds of .npz and makes the face that the model makes.

usage: read_files.py FOLDER
"""
import json
import os
import sys

try:
    import numpy as np
except ImportError:
    print("skipped: there is no NumPy (Debian: python3-numpy)")
    sys.exit(77)

folder = sys.argv[1]
with open(os.path.join(folder, "face.json"), encoding="utf-8") as file:
    expected = json.load(file)
face = np.array(expected["face_mm"]).reshape(-1, 3)
c, e = np.array(expected["shape"]), np.array(expected["expression"])

m = np.load(os.path.join(folder, "model.npz"))  # allow_pickle stays False
made = (m["shape_mean"].ravel() + m["shape_basis"] @ (np.sqrt(m["shape_variances"]) * c)
        + m["expression_mean"].ravel() + m["expression_basis"] @ (np.sqrt(m["expression_variances"]) * e)
        + expected["weight"] * m["blendshapes"][:, list(m["blendshape_names"]).index(expected["blendshape"])])
plain = np.abs(made.reshape(-1, 3) - face).max()
gram = m["shape_basis"].T @ m["shape_basis"]

f = np.load(os.path.join(folder, "flame.npz"))
names = list(f["dir_names"])
betas = np.zeros(len(names))
betas[:len(c)] = c
betas[names.index("expression mean")] = 1
betas[[names.index(f"expression {k + 1}") for k in range(len(e))]] = e
betas[names.index("blendshape " + expected["blendshape"])] = expected["weight"]
flame = np.abs((f["v_template"] + f["shapedirs"] @ betas) * 1000 - face).max()

print(f"model.npz: off by at most {plain:.1e} mm, |B'B - I| {np.abs(gram - np.eye(len(gram))).max():.1e}")
print(f"flame.npz: off by at most {flame:.1e} mm, {f['shapedirs'].shape[2]} directions, {f['identity_count'][0]} of identity")
sys.exit(0 if plain < 1e-4 and flame < 1e-4 and (f["f"] == m["faces"]).all() else 1)
