# SPDX-License-Identifier: Apache-2.0
# Facewright: multi-resolution 3D morphable face models.
"""Writes a planted model as other programs write theirs, each with its own units, index base, winding and scaling, and
imports it: h5py must find the same faces in the result by the rules of statismo.

usage: check_imports.py IMPORT_MODEL FOLDER
"""
import os
import shutil
import struct
import subprocess
import sys

try:
    import h5py
    import numpy as np
    from scipy.io import savemat
except ImportError as error:
    print(f"skipped: {error} (Debian: python3-numpy python3-h5py python3-scipy)")
    sys.exit(77)

PROGRAM, FOLDER = sys.argv[1:]
COLUMNS, ROWS, K = 11, 15, 4
N = COLUMNS * ROWS
rng = np.random.default_rng(3)


def planted():
    """A face-sized sheet in mm, triangles outward, orthonormal bases, variances, sRGB colours."""
    s, t = np.meshgrid(np.linspace(-1, 1, COLUMNS), np.linspace(-1, 1, ROWS))
    r = s * s + t * t
    mean = np.stack([70 * s, 95 * t, 90 * np.sqrt(1 - 0.45 * r) + 20 * np.exp(-30 * r)], -1).reshape(-1, 3)
    quads = [(v, v + 1, v + COLUMNS + 1, v + COLUMNS) for y in range(ROWS - 1) for v in
             range(y * COLUMNS, y * COLUMNS + COLUMNS - 1)]
    faces = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    basis = [np.linalg.qr(rng.normal(size=(3 * N, K)))[0] for _ in range(3)]
    sigma = np.array([40.0, 25, 12, 6])
    texture = np.clip(0.5 + 0.1 * rng.normal(size=3 * N), 0.2, 0.8)
    return mean, quads, faces, basis, sigma, texture


MEAN, QUADS, FACES, (SHAPE, COLOUR, EXPRESSION), SIGMA, TEXTURE = planted()
C = np.array([1.0, -2, 0.5, 1.5])
FACE = MEAN.ravel() + SHAPE @ (SIGMA * C)
failures = []


def linear(x):
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


def instance(file, part, coefficients):
    m = file[part + "/model"]
    return m["mean"][:] + m["pcaBasis"][:] @ (np.sqrt(m["pcaVariance"][:]) * coefficients)


def check(name, path, *flags, says=(), colour=None, uv=None, expression=False, blendshapes=()):
    out = os.path.join(FOLDER, name + ".h5")
    run = subprocess.run([PROGRAM, path, "-o", out, *flags], capture_output=True, text=True)
    print(f"== {name}\n{run.stdout}{run.stderr}", end="")
    problems = [f"does not say '{s}'" for s in says if s not in run.stdout]
    if run.returncode == 0:
        with h5py.File(out) as file:
            off = np.abs(instance(file, "shape", C) - FACE).max()
            cells = file["shape/representer/cells"][:].T
            if not off < 2e-4:
                problems.append(f"a face is off by {off} mm")
            rolled = np.stack([np.roll(cells, k, 1) for k in range(3)])
            if not all((rolled[:, i] == FACES[i]).all(1).any() for i in range(len(FACES))):
                problems.append("triangles differ")
            if colour is not None and not np.abs(file["color/model/mean"][:] - colour).max() < 1e-5:
                problems.append("colours differ")
            if uv is not None and not np.abs(file["metadata/ext/uv"][:] - uv).max() < 1e-6:
                problems.append("texture coordinates differ")
            if expression:
                e = instance(file, "expression", C)
                if not np.abs(e - EXPRESSION @ (SIGMA / 4 * C)).max() < 2e-4:
                    problems.append("expressions differ")
            for blendshape in blendshapes:
                if blendshape.encode() not in open(out, "rb").read():
                    problems.append(f"no blendshape {blendshape}")
    else:
        problems.append(f"ended with {run.returncode}")
    print("".join(f"   FAILED: {p}\n" for p in problems), end="")
    failures.extend(f"{name} {p}" for p in problems)


def place(name):
    return os.path.join(FOLDER, name)


def bfm2009(compressed):
    path = place(f"bfm{compressed}.mat")
    savemat(path, {"shapeMU": (MEAN.reshape(-1, 1) * 1000).astype("f4"), "shapePC": SHAPE.astype("f4"),
                   "shapeEV": SIGMA[:, None] * 1000, "texMU": TEXTURE[:, None] * 255, "texPC": COLOUR,
                   "texEV": np.array([[60.0], [30], [20], [10]]), "tl": (FACES[:, [0, 2, 1]] + 1).astype("f8"),
                   "segbin": np.zeros((3, 4))}, do_compression=compressed)
    return path


def matlab73():
    """What MATLAB's `save -v7.3` writes: HDF5 behind 512 bytes of text, arrays turned around."""
    path = place("v73.mat")
    with h5py.File(path, "w", userblock_size=512) as f:
        for name, value in (("shapeMU", MEAN.reshape(-1, 1) * 1000), ("shapePC", SHAPE), ("shapeEV", SIGMA[:, None] * 1000),
                            ("tl", (FACES[:, [0, 2, 1]] + 1).astype("f8"))):
            d = f.create_dataset(name, data=np.ascontiguousarray(value.T))
            kind = h5py.h5t.C_S1.copy()  # MATLAB's own: six bytes "double", said to end with a zero that is not there
            kind.set_size(6)
            label = h5py.h5a.create(d.id, b"MATLAB_class", kind, h5py.h5s.create(h5py.h5s.SCALAR))
            label.write(np.array(b"double", dtype="S6"), mtype=kind)
    with open(path, "r+b") as f:
        f.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM")
    return path


def scm():
    path = place("surrey.scm")
    part = lambda b, m, v: (struct.pack("<II", K, 3 * N) + b.T.astype("<f8").tobytes() + struct.pack("<I", 3 * N)
                            + m.astype("<f8").tobytes() + struct.pack("<I", K) + v.astype("<f8").tobytes())
    with open(path, "wb") as f:
        f.write(struct.pack("<II", N, len(FACES)) + FACES.astype("<u4").tobytes()
                + part(SHAPE, MEAN.ravel(), SIGMA ** 2) + part(COLOUR, TEXTURE, np.array([.01, .005, .002, .001])))
    uv = rng.uniform(size=(N, 2))
    np.savetxt(place("isomap.txt"), uv, fmt="%.9f")
    return path, np.stack([uv[:, 0], 1 - uv[:, 1]], 1)


def ict():
    folder = place("ict")
    os.makedirs(folder)
    meshes = {"generic_neutral_mesh": MEAN, "jawOpen": MEAN + 3, "browDown_L": MEAN - 1,
              **{f"identity{k:03}": MEAN + (SHAPE[:, k] * SIGMA[k]).reshape(-1, 3) for k in range(K)}}
    for name, V in meshes.items():
        with open(os.path.join(folder, name + ".obj"), "w", encoding="utf-8") as f:
            f.writelines("v %.9f %.9f %.9f\n" % tuple(v / 10) for v in V)
            f.writelines("f %d %d %d %d\n" % tuple(i + 1 for i in q) for q in QUADS)
    return folder


def flame():
    dirs = np.concatenate([SHAPE * SIGMA, EXPRESSION * SIGMA / 4], 1).reshape(N, 3, 2 * K) / 1000
    np.savez_compressed(place("flame.npz"), v_template=MEAN / 1000, shapedirs=dirs, f=FACES.astype("u4"),
                        posedirs=np.zeros((N, 3, 36)))
    return place("flame.npz")


def eos():
    matrix = lambda m: struct.pack("<ii", *m.shape) + m.astype("<f4").T.tobytes()
    tris = struct.pack("<Q", len(FACES)) + FACES.astype("<i4").tobytes()
    nothing = struct.pack("<iiiiiiQ", 0, 1, 0, 0, 0, 1, 0)
    with open(place("face.bin"), "wb") as f:
        f.write(struct.pack("<I", 1) + matrix(MEAN.reshape(-1, 1)) + matrix(SHAPE) + matrix(SIGMA[:, None] ** 2) + tris
                + nothing + struct.pack("<Q", 0))
    return place("face.bin")


def statismo():
    with h5py.File(place("momo.h5"), "w") as f:
        for part, mean, basis, variance in (("shape", MEAN.ravel(), SHAPE, SIGMA ** 2),
                                            ("color", TEXTURE, COLOUR, np.array([.01, .005, .002, .001]))):
            g = f.create_group(part)
            for name, value in (("mean", mean), ("pcaBasis", basis), ("pcaVariance", variance), ("noiseVariance", [0])):
                g["model/" + name] = np.array(value, "f4")
            g["representer/points"], g["representer/cells"] = MEAN.T.astype("f4"), FACES.T.astype("i4")
            g["representer"].attrs["name"] = np.bytes_("gravis::MeshShapeRepresenter")
            for place_ in (f, g):
                if "version" not in place_:
                    place_["version/majorVersion"], place_["version/minorVersion"] = np.int32(0), np.int32(9)
            g.create_group("modelinfo")
    return place("momo.h5")


shutil.rmtree(FOLDER, ignore_errors=True)
os.makedirs(FOLDER)
turned, squared = "triangles turned: clockwise seen from outside, as the format defines", "standard deviations given: squared"
for compressed in (False, True):
    check(f"bfm2009 {compressed}", bfm2009(compressed), colour=linear(TEXTURE),
          says=["um to mm", turned, squared, "triangles count from 1", "taken as sRGB", "0..255"])
check("bfm2009 v7.3", matlab73(), says=["um to mm", turned, squared])
savemat(place("lsfm.mat"), {"components": SHAPE, "eigenvalues": SIGMA[None] ** 2 * 0.01, "mean": MEAN.ravel()[None] / 10,
                            "trilist": FACES.astype("u4")}, do_compression=True)
check("lsfm", place("lsfm.mat"), says=["cm, found from the height", "variances given: kept", "count from 0"])
savemat(place("lyhm.mat"), {"shp": {"mu": MEAN.reshape(-1, 1), "eigVec": SHAPE, "eigVal": SIGMA[:, None] ** 2},
                            "tex": {"mu": TEXTURE[:, None], "eigVec": COLOUR, "eigVal": np.array([[.01], [.005], [.002], [.001]])},
                            "tri": (FACES[:, [0, 2, 1]] + 1).astype("i4")})
check("lyhm", place("lyhm.mat"), says=["mm, found from the height", turned], colour=linear(TEXTURE))
surrey, coordinates = scm()
check("scm", surrey, "--isomap", place("isomap.txt"), says=["mm as the format defines"], uv=coordinates, colour=linear(TEXTURE))
check("ict", ict(), says=["cm to mm", "basis scaled by sigma: divided", "quads are cut"], blendshapes=["jawOpen", "browDown_L"])
check("flame", flame(), "--identity-modes", str(K), expression=True, says=["m to mm", "sigma: divided", "left out: posedirs"])
check("eos", eos(), says=["mm as the format defines", "variances given: kept"])
check("statismo", statismo(), colour=linear(TEXTURE), says=["taken as sRGB"])
savemat(place("tilted.mat"), {"components": SHAPE.reshape(N, 3, K)[:, [0, 2, 1]].reshape(3 * N, K) * np.tile([[1], [-1], [1]], (N, 1)),
                              "eigenvalues": SIGMA ** 2, "mean": (MEAN[:, [0, 2, 1]] * [1, -1, 1]).ravel(), "trilist": FACES})
check("tilted, told which axes", place("tilted.mat"), "--axes", "x z -y", says=["as asked"])
refused = subprocess.run([PROGRAM, place("tilted.mat"), "-o", place("no.h5"), "--units", "mm"], capture_output=True, text=True)
print("== tilted, not told\n" + refused.stderr, end="")
if refused.returncode != 1 or "--axes" not in refused.stderr or os.path.exists(place("no.h5")):
    failures.append("a face that looks along -y was not refused")
print("\n".join(failures) or "all imports reproduce the planted faces")
sys.exit(1 if failures else 0)
