"""Materials, textures, lights, cameras, surfaces and extension functions: names, defaults and units are those of scene files,
which for the first four are Mitsuba's. What is left out has its default; values are checked when a scene is built.

Colours are linear RGB: a number, (r, g, b), or a texture.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any, Union

from ._document import FilePath, Table

Vector = Sequence[float]
Steps = Sequence[Mapping[str, Any]]


def _given(scope: Mapping[str, Any], kind: str | None) -> dict[str, Any]:
    return {"type": kind, **{key: value for key, value in scope.items() if key not in ("self", "__class__")}}


class Texture(Table):
    """A texture: `Bitmap` or `Checkerboard`."""


Colour = Union[float, Vector, Texture]


class Bitmap(Texture):
    """A picture file, looked up by texture coordinates.

    Parameters
    ----------
    file : path
    channel : str
        The one channel to take, such as "R".
    filter : {"bilinear", "nearest"}
    wrap : {"repeat", "mirror", "clamp"}
    raw : bool
        Whether the numbers are taken as they are, not as sRGB.
    to_uv : list of dict
        Steps {"scale": s}, {"rotate": degrees}, {"translate": (u, v)}.
    """

    def __init__(
        self,
        file: str | os.PathLike[str],
        *,
        channel: str | None = None,
        filter: str | None = None,
        wrap: str | None = None,
        raw: bool | None = None,
        to_uv: Steps | None = None,
    ) -> None:
        path = FilePath(os.fspath(file))
        super().__init__(
            {"texture": path, "channel": channel, "filter": filter, "wrap": wrap, "raw": raw, "to_uv": to_uv}
        )


class Checkerboard(Texture):
    """Squares of two colours."""

    def __init__(
        self, color0: float | Vector | None = None, color1: float | Vector | None = None, *, to_uv: Steps | None = None
    ) -> None:
        super().__init__({"checkerboard": Table({"color0": color0, "color1": color1, "to_uv": to_uv})})


class Material(Table):
    """What a surface does with light."""


class Diffuse(Material):
    """Reflects alike in all directions; `reflectance` is a colour in [0, 1]."""

    def __init__(self, reflectance: Colour | None = None, *, two_sided: bool | None = None) -> None:
        super().__init__(_given(locals(), "diffuse"))


class Conductor(Material):
    """A smooth metal: `material` names it ("Au", "Cu", …), or `eta` and `k` are its refractive index as RGB."""

    def __init__(
        self,
        material: str | None = None,
        *,
        eta: Colour | None = None,
        k: Colour | None = None,
        specular_reflectance: Colour | None = None,
        two_sided: bool | None = None,
    ) -> None:
        super().__init__(_given(locals(), "conductor"))


class RoughConductor(Material):
    """A rough metal: as `Conductor`, with a microfacet `distribution` and its roughness `alpha`."""

    def __init__(
        self,
        material: str | None = None,
        *,
        eta: Colour | None = None,
        k: Colour | None = None,
        specular_reflectance: Colour | None = None,
        distribution: str | None = None,
        alpha: Colour | None = None,
        alpha_u: Colour | None = None,
        alpha_v: Colour | None = None,
        two_sided: bool | None = None,
    ) -> None:
        super().__init__(_given(locals(), "roughconductor"))


class Dielectric(Material):
    """Smooth glass; `int_ior` and `ext_ior` are refractive indices or the names of media."""

    def __init__(
        self,
        *,
        int_ior: float | str | None = None,
        ext_ior: float | str | None = None,
        specular_reflectance: Colour | None = None,
        specular_transmittance: Colour | None = None,
    ) -> None:
        super().__init__(_given(locals(), "dielectric"))


class RoughDielectric(Material):
    """Rough glass: as `Dielectric`, with a microfacet `distribution` and its roughness `alpha`."""

    def __init__(
        self,
        *,
        int_ior: float | str | None = None,
        ext_ior: float | str | None = None,
        specular_reflectance: Colour | None = None,
        specular_transmittance: Colour | None = None,
        distribution: str | None = None,
        alpha: Colour | None = None,
        alpha_u: Colour | None = None,
        alpha_v: Colour | None = None,
    ) -> None:
        super().__init__(_given(locals(), "roughdielectric"))


class Plastic(Material):
    """A diffuse base under a smooth coat."""

    def __init__(
        self,
        *,
        diffuse_reflectance: Colour | None = None,
        specular_reflectance: Colour | None = None,
        int_ior: float | str | None = None,
        ext_ior: float | str | None = None,
        nonlinear: bool | None = None,
        two_sided: bool | None = None,
    ) -> None:
        super().__init__(_given(locals(), "plastic"))


class RoughPlastic(Material):
    """A diffuse base under a rough coat: as `Plastic`, with a microfacet `distribution` and its roughness `alpha`."""

    def __init__(
        self,
        *,
        diffuse_reflectance: Colour | None = None,
        specular_reflectance: Colour | None = None,
        int_ior: float | str | None = None,
        ext_ior: float | str | None = None,
        nonlinear: bool | None = None,
        distribution: str | None = None,
        alpha: float | None = None,
        two_sided: bool | None = None,
    ) -> None:
        super().__init__(_given(locals(), "roughplastic"))


class Principled(Material):
    """Disney's material; shares are numbers in [0, 1] or textures, `eta` a refractive index."""

    def __init__(
        self,
        base_color: Colour | None = None,
        *,
        roughness: float | Texture | None = None,
        anisotropic: float | Texture | None = None,
        metallic: float | Texture | None = None,
        spec_trans: float | Texture | None = None,
        eta: float | None = None,
        specular: float | None = None,
        spec_tint: float | Texture | None = None,
        sheen: float | Texture | None = None,
        sheen_tint: float | Texture | None = None,
        flatness: float | Texture | None = None,
        clearcoat: float | Texture | None = None,
        clearcoat_gloss: float | Texture | None = None,
        two_sided: bool | None = None,
    ) -> None:
        super().__init__(_given(locals(), "principled"))


class Light(Table):
    """A source of light."""


class Constant(Light):
    """The same `radiance` from every direction."""

    def __init__(self, radiance: float | Vector | None = None) -> None:
        super().__init__(_given(locals(), "constant"))


class Envmap(Light):
    """A picture around the scene: longitude along its rows."""

    def __init__(
        self, file: str | os.PathLike[str], *, scale: float | None = None, to_world: Steps | None = None
    ) -> None:
        path = FilePath(os.fspath(file))
        super().__init__({"type": "envmap", "file": path, "scale": scale, "to_world": to_world})


class Point(Light):
    """A point that shines alike in all directions."""

    def __init__(self, position: Vector, intensity: float | Vector | None = None) -> None:
        super().__init__(_given(locals(), "point"))


class Spot(Light):
    """A point that shines into a cone; angles in degrees."""

    def __init__(
        self,
        to_world: Steps,
        intensity: float | Vector | None = None,
        *,
        cutoff_angle: float | None = None,
        beam_width: float | None = None,
    ) -> None:
        super().__init__(_given(locals(), "spot"))


class Directional(Light):
    """Light that comes along `direction` from infinitely far."""

    def __init__(
        self,
        direction: Vector | None = None,
        irradiance: float | Vector | None = None,
        *,
        to_world: Steps | None = None,
    ) -> None:
        super().__init__(_given(locals(), "directional"))


class Area(Light):
    """A shape that shines: `shape` is "rectangle", "disk" or "sphere", placed by `to_world`, or "object" with an `Object` of the scene."""

    def __init__(
        self,
        shape: str,
        radiance: float | Vector | None = None,
        *,
        to_world: Steps | None = None,
        center: Vector | None = None,
        radius: float | None = None,
        object: Any = None,
    ) -> None:
        super().__init__(_given(locals(), "area"))


class Camera(Table):
    """How a scene is seen."""


class Perspective(Camera):
    """A pinhole, or a lens if `aperture_radius` is above 0.

    Parameters
    ----------
    origin, target : (x, y, z)
    up : (x, y, z)
        Default (0, 0, 1).
    fov : float
        Degrees along `fov_axis`: "x", "y", "diagonal", "smaller" or "larger".
    aperture_radius, focus_distance : float
        World units.
    """

    def __init__(
        self,
        origin: Vector,
        target: Vector,
        up: Vector | None = None,
        *,
        fov: float | None = None,
        fov_axis: str | None = None,
        aperture_radius: float | None = None,
        focus_distance: float | None = None,
    ) -> None:
        super().__init__(_given(locals(), "perspective"))


class ThinLens(Camera):
    """As `Perspective`, with a lens."""

    def __init__(
        self,
        origin: Vector,
        target: Vector,
        up: Vector | None = None,
        *,
        aperture_radius: float,
        focus_distance: float | None = None,
        fov: float | None = None,
        fov_axis: str | None = None,
    ) -> None:
        super().__init__(_given(locals(), "thinlens"))


class Orthographic(Camera):
    """Parallel rays; `width` is that of the picture in world units."""

    def __init__(self, origin: Vector, target: Vector, up: Vector | None = None, *, width: float) -> None:
        super().__init__(_given(locals(), "orthographic"))


class Surface(Table):
    """A parametric surface: `type` is "bezier", "bspline", "plane", "sphere", "cylinder", "cone" or "torus", the others its parameters.

    Examples
    --------
    >>> import trimray as tr
    >>> ball = tr.Surface("sphere", radius=1.0)
    """

    def __init__(self, type: str, **parameters: Any) -> None:
        super().__init__({"type": type, **parameters})


class Extension(Table):
    """A deformation of a surface by extension functions (Wang et al.).

    Parameters
    ----------
    mode : {"operator", "radial", "field"}
    region : list of dict
        Each with `bound`, the text of φ(u, v), and what else scene files have.
    """

    def __init__(
        self,
        mode: str,
        region: Sequence[Mapping[str, Any]],
        *,
        center: Vector | None = None,
        axes: Sequence[Vector] | None = None,
        field: str | Vector | Sequence[str] | None = None,
    ) -> None:
        super().__init__(_given(locals(), "extension"))
