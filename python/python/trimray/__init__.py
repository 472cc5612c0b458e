"""Exact ray casting, free-form deformation and pictures of deformed shapes, in double precision.

Shapes are kept as trimmed Bézier patches, without approximation, and rays are traced against those. Lengths are world units, angles
degrees, arrays float64; arguments are anything that NumPy takes, of any leading shape.
"""

from . import trimesh
from ._errors import Error, InputError, OutOfMemoryError, OutputError, SceneError, SceneWarning, WorkError
from ._lattice import Drag, Lattice
from ._mesh import Mesh, load_mesh
from ._object import Deviation, LatticeJacobian, Object, Patch, SceneObject, Tessellation
from ._picture import Difference, Picture, diff
from ._scene import AllHits, Hits, Scene, load
from ._tables import (
    Area,
    Bitmap,
    Camera,
    Checkerboard,
    Conductor,
    Constant,
    Dielectric,
    Diffuse,
    Directional,
    Envmap,
    Extension,
    Light,
    Material,
    Orthographic,
    Perspective,
    Plastic,
    Point,
    Principled,
    RoughConductor,
    RoughDielectric,
    RoughPlastic,
    Spot,
    Surface,
    Texture,
    ThinLens,
)
from ._trimray import __version__

__all__ = [
    "AllHits",
    "Area",
    "Bitmap",
    "Camera",
    "Checkerboard",
    "Conductor",
    "Constant",
    "Deviation",
    "Dielectric",
    "Difference",
    "Diffuse",
    "Directional",
    "Drag",
    "Envmap",
    "Error",
    "Extension",
    "Hits",
    "InputError",
    "Lattice",
    "LatticeJacobian",
    "Light",
    "Material",
    "Mesh",
    "Object",
    "Orthographic",
    "OutOfMemoryError",
    "OutputError",
    "Patch",
    "Perspective",
    "Picture",
    "Plastic",
    "Point",
    "Principled",
    "RoughConductor",
    "RoughDielectric",
    "RoughPlastic",
    "Scene",
    "SceneError",
    "SceneObject",
    "SceneWarning",
    "Spot",
    "Surface",
    "Tessellation",
    "Texture",
    "ThinLens",
    "WorkError",
    "__version__",
    "diff",
    "load",
    "load_mesh",
    "trimesh",
]
