"""One peer, in a process and a virtual environment of its own: peers.py NAME INPUTS.npz THREADS OUTPUT.npz

Prepares, says so, then runs once for each line on standard input, the number of the round: answers with the
milliseconds on standard output and leaves the arrays in OUTPUT.npz. A peer is a function of (inputs, threads) that
prepares and returns the call to time, a function of the round.
"""

import json
import os
import sys

import numpy as np
from harness import timed

PEERS = {}


def peer(name):
    def keep(prepare):
        PEERS[name] = prepare
        return prepare

    return keep


def small_gicp_align(kind):
    """Converged to the same tolerance as ours; pairs up to 40 mm apart."""

    def prepare(inputs, threads):
        import small_gicp

        def preprocess(points):
            cloud = small_gicp.PointCloud(points)
            tree = small_gicp.KdTree(cloud, num_threads=threads)
            small_gicp.estimate_normals_covariances(cloud, tree, num_neighbors=20, num_threads=threads)
            return cloud, tree

        def align(target, target_tree, source):
            result = small_gicp.align(
                target,
                source,
                target_tree,
                registration_type=kind,
                max_correspondence_distance=40.0,
                num_threads=threads,
                max_iterations=60,
                rotation_epsilon=1e-6,
                translation_epsilon=1e-4,
            )
            return {"reference_from_live": result.T_target_source}

        pairs = list(zip(inputs["reference"], inputs["live"], strict=True))
        if inputs["with_preparation"]:
            return lambda index: align(*preprocess(pairs[index][0]), preprocess(pairs[index][1])[0])
        ready = [(*preprocess(reference), preprocess(live)[0]) for reference, live in pairs]
        return lambda index: align(*ready[index])

    return prepare


PEERS["small_gicp GICP"] = small_gicp_align("GICP")
PEERS["small_gicp PLANE_ICP"] = small_gicp_align("PLANE_ICP")


@peer("Open3D point-to-plane")
def open3d_align(inputs, threads):
    """Its k-d tree is built inside the call in any case; the number of threads is OpenMP's (OMP_NUM_THREADS)."""
    import open3d

    registration = open3d.pipelines.registration
    criteria = registration.ICPConvergenceCriteria(relative_fitness=1e-9, relative_rmse=1e-9, max_iteration=60)

    def cloud_of(points):
        return open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))

    def with_normals(cloud):
        cloud.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(20))
        return cloud

    def align(target, source):
        method = registration.TransformationEstimationPointToPlane()
        result = registration.registration_icp(source, target, 40.0, np.eye(4), method, criteria)
        return {"reference_from_live": result.transformation}

    pairs = list(zip(inputs["reference"], inputs["live"], strict=True))
    if inputs["with_preparation"]:
        return lambda index: align(with_normals(cloud_of(pairs[index][0])), cloud_of(pairs[index][1]))
    ready = [(with_normals(cloud_of(reference)), cloud_of(live)) for reference, live in pairs]
    return lambda index: align(*ready[index])


@peer("NumPy")
def numpy_tof(inputs, threads):
    """Four taps of the textbook; no flags, no flying pixels."""
    rays, mm_per_rad = inputs["rays"], np.float32(inputs["mm_per_rad"])

    def measure(_):
        t0, t1, t2, t3 = inputs["taps"][0].astype(np.float32)
        s, c = t1 - t3, t0 - t2
        phase = np.arctan2(s, c)
        phase[phase < 0] += np.float32(2 * np.pi)
        amplitude = np.hypot(s, c) / 2
        offset = (t0 + t1 + t2 + t3) / 4
        distance = phase * mm_per_rad
        sigma = mm_per_rad * np.sqrt(offset / 2) / amplitude
        return {"range": distance, "sigma": sigma, "points": distance[..., None] * rays}

    return measure


@peer("NumPy centroid")
def numpy_stripe(inputs, threads):
    """The brightest pixel of a row, the mean of its flanks as background, the centroid of 9 pixels about it."""
    frames = inputs["frames"]
    reach = np.arange(-8, 9)

    def extract(_):
        found = []
        for image in frames:
            at = image.argmax(axis=1)
            columns = np.clip(at[:, None] + reach, 0, image.shape[1] - 1)
            window = np.take_along_axis(image, columns, axis=1).astype(np.float32)
            inside = window[:, 4:13] - (window[:, :4].mean(axis=1) + window[:, 13:].mean(axis=1))[:, None] / 2
            found.append(at + (inside * reach[4:13]).sum(axis=1) / inside.sum(axis=1))
        return {"centre": found[0]}

    return extract


def opencv_stereo(make):
    def prepare(inputs, threads):
        import cv2

        matcher = make(cv2, int(inputs["levels"]))

        def match(_):
            disparity = matcher.compute(inputs["left"], inputs["right"]).astype(np.float32) / 16
            disparity[disparity < 0] = np.nan
            return {"disparity": disparity}

        return match

    return prepare


def sgbm(mode):
    def make(cv2, levels):
        return cv2.StereoSGBM_create(
            minDisparity=0,
            numDisparities=levels,
            blockSize=5,
            P1=8 * 25,
            P2=32 * 25,
            disp12MaxDiff=1,
            uniquenessRatio=10,
            mode=getattr(cv2, mode),
        )

    return make


PEERS["OpenCV BM"] = opencv_stereo(lambda cv2, levels: cv2.StereoBM_create(numDisparities=levels, blockSize=17))
PEERS["OpenCV SGBM"] = opencv_stereo(sgbm("STEREO_SGBM_MODE_SGBM"))
PEERS["OpenCV SGBM 3-way"] = opencv_stereo(sgbm("STEREO_SGBM_MODE_SGBM_3WAY"))


@peer("OpenCV projectPoints")
def opencv_project(inputs, threads):
    import cv2

    pose = inputs["camera_from_room"]
    turn, shift = cv2.Rodrigues(pose[:3, :3])[0], pose[:3, 3].copy()
    matrix, distortion, points = inputs["matrix"], inputs["distortion"], inputs["points"]
    return lambda _: {"pixels": cv2.projectPoints(points, turn, shift, matrix, distortion)[0].reshape(-1, 2)}


@peer("OpenCV undistortPoints")
def opencv_undistort(inputs, threads):
    """Its fixed 5 iterations; the result is made a unit direction in the room, as ours."""
    import cv2

    rotation = np.ascontiguousarray(inputs["camera_from_room"][:3, :3])
    matrix, distortion, pixels = inputs["matrix"], inputs["distortion"], inputs["pixels"]

    def unproject(_):
        plane = cv2.undistortPoints(pixels, matrix, distortion).reshape(-1, 2)
        rays = np.concatenate([plane, np.ones((len(plane), 1))], axis=1) @ rotation
        return {"directions": rays / np.linalg.norm(rays, axis=1, keepdims=True)}

    return unproject


NURBS_ORDERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))


def splipy_surface(inputs):
    import splipy

    basis = splipy.BSplineBasis(4, inputs["knots"])
    points = inputs["points"].transpose(1, 0, 2).reshape(-1, 3)  # u fastest
    return splipy.Surface(basis, basis, points)


@peer("splipy")
def splipy_grid(inputs, threads):
    surface, u, v = splipy_surface(inputs), inputs["u"], inputs["v"]
    return lambda _: {"points": surface(u, v)}


@peer("splipy derivatives")
def splipy_derivatives(inputs, threads):
    surface, u, v = splipy_surface(inputs), inputs["u"], inputs["v"]
    return lambda _: {"points": np.stack([surface.derivative(u, v, d=d) for d in NURBS_ORDERS], axis=2)}


def geomdl_surface(inputs):
    from geomdl import BSpline

    surface = BSpline.Surface()
    surface.degree_u = surface.degree_v = 3
    surface.set_ctrlpts(inputs["points"].reshape(-1, 3).tolist(), *inputs["points"].shape[:2])
    surface.knotvector_u = surface.knotvector_v = inputs["knots"].tolist()
    return surface


@peer("geomdl")
def geomdl_grid(inputs, threads):
    surface = geomdl_surface(inputs)
    surface.sample_size_u, surface.sample_size_v = len(inputs["u"]), len(inputs["v"])
    shape = len(inputs["u"]), len(inputs["v"]), 3

    def evaluate(_):
        surface.evaluate()
        return {"points": np.reshape(surface.evalpts, shape)}

    return evaluate


@peer("geomdl derivatives")
def geomdl_derivatives(inputs, threads):
    surface = geomdl_surface(inputs)
    pairs = list(zip(inputs["u"].tolist(), inputs["v"].tolist(), strict=True))

    def evaluate(_):
        tables = [surface.derivatives(u, v, 2) for u, v in pairs]
        return {"points": np.array([[table[k][m] for k, m in NURBS_ORDERS] for table in tables])}

    return evaluate


def scipy_scattered(orders):
    """RectBivariateSpline interpolates a grid; here it is given the very spline, a coordinate each."""

    def prepare(inputs, threads):
        from scipy.interpolate import RectBivariateSpline

        splines = []
        for c in range(3):
            spline = RectBivariateSpline(np.arange(40.0), np.arange(40.0), np.zeros((40, 40)))
            spline.tck = inputs["knots"], inputs["knots"], inputs["points"][:, :, c].ravel()
            splines.append(spline)
        u, v = inputs["u"], inputs["v"]

        def evaluate(_):
            values = [np.stack([s.ev(u, v, dx=k, dy=m) for s in splines], -1) for k, m in NURBS_ORDERS[:orders]]
            return {"points": values[0] if orders == 1 else np.stack(values, axis=1)}

        return evaluate

    return prepare


def scipy_spline(smooth):
    """LSQ on the knots of ours, or FITPACK's choice of knots for a sum of squares of n sigma^2."""

    def prepare(inputs, threads):
        from scipy.interpolate import LSQBivariateSpline, SmoothBivariateSpline

        (x, y, z), side, noise = inputs["points"].T.copy(), inputs["side"], float(inputs["noise"])
        knots = [np.linspace(v.min(), v.max(), int(inputs["control"]) - 2)[1:-1] for v in (x, y)]

        def fit(_):
            if smooth:
                spline = SmoothBivariateSpline(x, y, z, w=np.full(len(x), 1 / noise), s=len(x))
            else:
                spline = LSQBivariateSpline(x, y, z, *knots)
            return {"z": spline(side, side)}

        return fit

    return prepare


PEERS["scipy RectBivariateSpline.ev"] = scipy_scattered(1)
PEERS["scipy RectBivariateSpline.ev to 2nd"] = scipy_scattered(6)
PEERS["scipy LSQBivariateSpline"] = scipy_spline(False)
PEERS["scipy SmoothBivariateSpline"] = scipy_spline(True)


@peer("OpenCV calibrateCamera")
def opencv_calibrate(inputs, threads):
    import cv2

    views = [view.astype(np.float32) for view in inputs["views"]]
    boards = [inputs["board"].astype(np.float32)] * len(views)
    size = tuple(int(side) for side in inputs["size"])

    def calibrate(_):
        _, matrix, distortion, _, _ = cv2.calibrateCamera(boards, views, size, None, None)
        places = [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]]
        return {"lens": np.concatenate([places, distortion.ravel()[:5]])}

    return calibrate


@peer("OpenCV bilateralFilter")
def opencv_bilateral(inputs, threads):
    """Its range kernel at three sigmas of the difference of two points, its space kernel as wide as ours."""
    import cv2

    z, radius, sigma = inputs["noisy"].astype(np.float32), float(inputs["radius"]), float(inputs["sigma"])
    return lambda _: {"z": cv2.bilateralFilter(z, 2 * int(radius) + 1, 3 * 2**0.5 * sigma, radius / 2)}


def main():
    name, inputs_path, threads, output = sys.argv[1:]
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what the libraries print goes to standard error

    def answer(value):
        answers.write(json.dumps(value) + "\n")
        answers.flush()

    with np.load(inputs_path) as file:
        inputs = dict(file)
    call = timed(PEERS[name](inputs, int(threads)))
    answer(0)
    for line in sys.stdin:
        milliseconds, arrays = call(int(line))
        np.savez(output, **arrays)
        answer(milliseconds)


if __name__ == "__main__":
    main()
