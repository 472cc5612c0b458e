"""STEP files as OpenCASCADE reads them.

    python step.py [--rays N] [--keep FOLDER] SCENE...

Each scene is exported as STEP and read by OpenCASCADE, which must find:

1.  Valid shapes, with exact tests of geometry; as many solids, shells, faces and edges as trimray says it wrote.
2.  Edges and vertices whose tolerance is what the file gives as uncertainty.
3.  The volume of closed solids and the area of all faces, by OpenCASCADE's integration, as triangles of trimray have them, to 1e-6. Triangles
    that halve their edges have errors that fall by four each time; two levels give the limit.
4.  The first hits of rays, by OpenCASCADE's own intersection of lines and faces, at the same distance to 1e-7 of the diagonal and 20 times what the
    surfaces are off. A ray on
    which they differ must pass an edge or a silhouette: moved sideways by 1e-6 of the diagonal, in one of eight directions, both agree.
"""

import argparse
import re
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
from deformed import binary, fail_unless
from OCP.BRep import BRep_Tool
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.gp import gp_Dir, gp_Lin, gp_Pnt
from OCP.GProp import GProp_GProps
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.IntCurvesFace import IntCurvesFace_ShapeIntersector
from OCP.Interface import Interface_Static
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS

# Volume and area, relative.
INTEGRAL = 1e-6

# Triangles of a scene, about: the more, the nearer their limit is.
TRIANGLES = 400_000

# Hits, in parts of the diagonal.
DISTANCE = 1e-7

# How far a ray that the two differ on is moved, in parts of the diagonal.
MOVED = 1e-6

REPORT = re.compile(
    r"trimray: (?P<name>.*?): (?:(?P<solids>\d+) solids?)?(?:, )?(?:(?P<voids>\d+) cavit(?:y|ies))?(?:, )?"
    r"(?:(?P<open>\d+) open shells?)?, (?P<faces>\d+) faces?, (?P<edges>\d+) edges?, greatest degree (?P<degree>\d+), "
    r"(?:exact|within (?P<error>\S+) of the exact surface)$"
)


def trimray(*arguments):
    """Runs the program; returns what it says on stderr."""
    command = [str(binary()), *map(str, arguments)]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    fail_unless(done.returncode == 0, f"{' '.join(command)}: exit {done.returncode}\n{done.stderr}")
    return done.stderr


def each(shape, kind):
    """The different sub-shapes of a kind, whatever their orientation."""
    found, explorer = {}, TopExp_Explorer(shape, kind)
    while explorer.More():
        same = found.setdefault(hash(explorer.Current()), [])
        if not any(explorer.Current().IsSame(other) for other in same):
            same.append(explorer.Current())
        explorer.Next()
    return [shape for same in found.values() for shape in same]


def read(path):
    """The shape in a STEP file, in the units of the file, and the seconds it takes."""
    started = time.time()
    reader = STEPControl_Reader()
    Interface_Static.SetCVal_s("xstep.cascade.unit", "MM")
    fail_unless(reader.ReadFile(str(path)) == IFSelect_ReturnStatus.IFSelect_RetDone, f"{path} is not read")
    reader.TransferRoots()
    return reader.OneShape(), time.time() - started


def integrals(shape):
    """Volume of the solids and area of all faces."""
    volume, area = GProp_GProps(), GProp_GProps()
    for solid in each(shape, TopAbs_ShapeEnum.TopAbs_SOLID):
        of_solid = GProp_GProps()
        BRepGProp.VolumeProperties_s(solid, of_solid, 1e-9)
        volume.Add(of_solid)
    BRepGProp.SurfaceProperties_s(shape, area, 1e-9)
    return volume.Mass(), area.Mass()


def triangles(path):
    """Corners (N, 3, 3) of the triangles of an OBJ file that trimray has written, and the object of each."""
    positions, indices, objects, name = [], [], [], ""
    for line in path.read_text(encoding="utf-8").splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            positions.append([float(word) for word in words[1:4]])
        elif words[:1] == ["o"]:
            name = line.partition(" ")[2]
        elif words[:1] == ["f"]:
            indices.append([int(word.split("/")[0]) - 1 for word in words[1:]])
            objects.append(name)
    return np.array(positions)[np.array(indices)], np.array(objects)


def triangle_integrals(scene, folder, level, solids):
    """Volume of the scene's solid objects and area of all, by triangles."""
    path = folder / f"level{level}.obj"
    trimray("export", scene, "-o", path, "--level", level, "--quiet")
    corners, objects = triangles(path)
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = np.cross(b - a, c - a)
    of_solid = np.isin(objects, solids)
    volume = np.einsum("ni,ni->", a[of_solid], normal[of_solid]) / 6
    return np.array([volume, np.linalg.norm(normal, axis=1).sum() / 2]), a


def first_hits(shape, rays, reach):
    """Distances of the first hits of lines with the faces, inf where there is none."""
    intersector = IntCurvesFace_ShapeIntersector()
    intersector.Load(shape, 1e-10)
    found = np.full(len(rays), np.inf)
    for number, ray in enumerate(rays):
        intersector.Perform(gp_Lin(gp_Pnt(*ray[:3]), gp_Dir(*ray[3:])), 0.0, reach)
        count = intersector.NbPnt()
        if count:
            found[number] = min(intersector.WParameter(i + 1) for i in range(count))
    return found


def trace(scene, rays, folder):
    """trimray's first hits."""
    np.save(folder / "rays.npy", rays)
    trimray("trace", scene, "--rays", folder / "rays.npy", "-o", folder / "hits.npz")
    with np.load(folder / "hits.npz") as hits:
        return hits["t"]


def differ(ours, theirs, distance):
    """Where two sets of distances are not the same."""
    both = np.isfinite(ours) & np.isfinite(theirs)
    with np.errstate(invalid="ignore"):
        return np.where(both, np.abs(ours - theirs) > distance, np.isfinite(ours) != np.isfinite(theirs))


def check_rays(scene, shape, corners, count, folder, error):
    """Compares first hits, of surfaces that are off by `error`; returns how many rays hit, and how many differ for no reason."""
    random = np.random.default_rng(7)
    low, high = corners.min(0), corners.max(0)
    centre, diagonal = (low + high) / 2, np.linalg.norm(high - low)
    ways = random.standard_normal((2, count, 3))
    ways /= np.linalg.norm(ways, axis=2, keepdims=True)
    origin = centre + diagonal * ways[0]
    target = centre + 0.4 * (high - low) * random.uniform(-1, 1, (count, 3))
    direction = target - origin
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    rays = np.concatenate([origin, direction], axis=1)
    ours, theirs = trace(scene, rays, folder), first_hits(shape, rays, 4 * diagonal)
    # rays meet surfaces that are off at angles down to some degrees; those at smaller ones are odd
    distance, moved_by = DISTANCE * diagonal + 20 * error, MOVED * diagonal + 4 * error
    odd = np.flatnonzero(differ(ours, theirs, distance))
    unexplained = 0
    for number in odd:
        across = np.linalg.svd(direction[number][None])[2][1:]
        turns = np.arange(8) * np.pi / 4
        steps = moved_by * (np.cos(turns)[:, None] * across[0] + np.sin(turns)[:, None] * across[1])
        moved = np.repeat(rays[number][None], 8, axis=0)
        moved[:, :3] += steps
        unexplained += not np.any(~differ(trace(scene, moved, folder), first_hits(shape, moved, 4 * diagonal), distance))
    return int(np.isfinite(ours).sum()), len(odd), unexplained


def check(scene, rays, folder):
    """All checks of one scene."""
    path = folder / f"{scene.stem}.step"
    started = time.time()
    said = trimray("export", scene, "-o", path)
    wrote = time.time() - started
    reports = [match for match in map(REPORT.match, said.splitlines()) if match]
    fail_unless(reports, f"{scene.name}: no report in {said}")
    total = {key: sum(int(report[key] or 0) for report in reports) for key in ("solids", "voids", "open", "faces", "edges")}
    shape, seconds = read(path)
    kinds = TopAbs_ShapeEnum
    edges, vertices = each(shape, kinds.TopAbs_EDGE), each(shape, kinds.TopAbs_VERTEX)
    # OpenCASCADE adds edges of no length where a side of a surface is a pole
    edges = [edge for edge in edges if not BRep_Tool.Degenerated_s(TopoDS.Edge(edge))]
    shells = each(shape, kinds.TopAbs_SHELL)
    found = {
        "solids": len(each(shape, kinds.TopAbs_SOLID)),
        "shells": len(shells),
        "closed": sum(BRep_Tool.IsClosed_s(shell) for shell in shells),
        "faces": len(each(shape, kinds.TopAbs_FACE)),
        "edges": len(edges),
    }
    wanted = {
        "solids": total["solids"],
        "shells": total["solids"] + total["voids"] + total["open"],
        "closed": total["solids"] + total["voids"],
        "faces": total["faces"],
        "edges": total["edges"],
    }
    fail_unless(found == wanted, f"{scene.name}: OpenCASCADE has {found}, trimray wrote {wanted}")
    fail_unless(BRepCheck_Analyzer(shape, True, False, True).IsValid(), f"{scene.name}: not valid")
    tolerance = max(
        [BRep_Tool.Tolerance_s(TopoDS.Edge(edge)) for edge in edges]
        + [BRep_Tool.Tolerance_s(TopoDS.Vertex(vertex)) for vertex in vertices]
    )
    # two neighbours may be off in opposite directions
    error = max([float(report["error"]) * 1.05 for report in reports if report["error"]], default=0.0)
    allowed = max(1e-7, 2 * error)
    fail_unless(tolerance <= allowed * (1 + 1e-9), f"{scene.name}: tolerance {tolerance}, not {allowed}")
    volume, area = integrals(shape)
    solids = [report["name"] for report in reports if report["solids"] and not report["open"]]
    _, few = triangle_integrals(scene, folder, 0, solids)
    level = max(2, int(np.log2(TRIANGLES / len(few)) / 2))
    (coarse, _), (fine, corners) = (triangle_integrals(scene, folder, level + up, solids) for up in (0, 1))
    limit = (4 * fine - coarse) / 3
    off = abs(area / limit[1] - 1)
    if len(solids) == sum(bool(report["solids"]) for report in reports) and solids:
        off = max(off, abs(volume / limit[0] - 1))
    fail_unless(off <= INTEGRAL, f"{scene.name}: volume {volume}, area {area}, of triangles {limit}: off by {off}")
    hits, odd, unexplained = check_rays(scene, shape, corners, rays, folder, error)
    fail_unless(unexplained == 0, f"{scene.name}: {unexplained} of {rays} rays differ")
    fail_unless(hits > rays // 20, f"{scene.name}: {hits} of {rays} rays hit")
    print(
        f"{scene.name}: {found['solids']} solids, {found['shells']} shells, {found['faces']} faces, {found['edges']} edges, valid, "
        f"tolerance {tolerance:.1e}, integrals off {off:.1e}, {hits} of {rays} rays hit, {odd} at edges; "
        f"{path.stat().st_size} bytes, exported in {wrote:.2f} s, read in {seconds:.2f} s",
        flush=True,
    )


def main():
    """Checks all scenes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=int, default=300, help="rays a scene")
    parser.add_argument("--keep", type=Path, help="folder for the STEP files")
    parser.add_argument("scene", type=Path, nargs="+")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = arguments.keep or Path(temporary)
        for scene in arguments.scene:
            check(scene, arguments.rays, folder)


if __name__ == "__main__":
    main()
