"""Free-form deformation by control lattices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._arrays import Floats, numbers, rows
from ._document import headed
from ._trimray import Lattice as _Lattice

_BALL = '[[object]]\nname = "lattice"\nsurface = { type = "sphere", radius = 1.0 }\n'


class Drag(NamedTuple):
    """What a drag of points did."""

    #: Number of drags that do not follow from the others.
    rank: int
    #: Greatest over least singular value of those.
    condition: float
    #: Sum of the squared changes of the lattice, which is the least.
    objective: float
    #: Where the points are now, of shape (N, 3).
    reached: Floats


class Lattice:
    """A B-spline volume over a box: a map of space, the identity until its control points are edited.

    Control points, weights and edits are live: what uses the lattice afterwards sees them as they are then. A `Scene` keeps
    what it was made of.

    Parameters
    ----------
    degree : (int, int, int)
        Along each axis, 1 to 4.
    points : (int, int, int)
        Control points along each axis, more than the degree.
    bounds : array_like of shape (2, 3), optional
        Least and greatest corner of the box. Without it the box is that of the object which is deformed, as the lattice receives
        it; the lattice can then be edited but by its own methods only, and is no map yet.
    outside : {"keep", "error"}
        What becomes of points outside the box.
    hold : int
        Outermost layers of control points that stay where they are.
    frame : {"parallelogram", "rectangle"}
        The frames of the patches.

    Examples
    --------
    >>> import trimray as tr
    >>> box = tr.Lattice(degree=(2, 2, 2), points=(4, 4, 4), bounds=[[0, 0, 0], [1, 1, 1]])
    >>> box.twist("z", 90).control_points[1, 2, 3] += 0.1
    >>> box([0.5, 0.5, 0.0]).round(3).tolist()
    [0.5, 0.5, 0.0]
    """

    def __init__(
        self,
        degree: Sequence[int] = (3, 3, 3),
        points: Sequence[int] = (6, 6, 6),
        bounds: Any = None,
        *,
        outside: str = "keep",
        hold: int = 0,
        frame: str | None = None,
    ) -> None:
        box = None if bounds is None else numbers("bounds", bounds, 3).tolist()
        self._settings: dict[str, Any] = {
            "type": "ffd",
            "degree": [*degree],
            "points": [*points],
            "bounds": box,
            "outside": outside,
            "hold": hold,
            "frame": frame,
        }
        self._edits: list[dict[str, Any]] = []
        self._native = None if box is None else _Lattice(self._text({}))

    def _text(self, edit: Mapping[str, Any]) -> str:
        """A scene whose only object has this lattice, with an edit."""
        text = _BALL + headed("[[object.deform]]", self._settings)
        return text + headed("[[object.deform.edit]]", edit) if edit else text

    def _edited(self, edit: dict[str, Any]) -> Lattice:
        if self._native is None:
            self._edits.append(edit)
        else:
            self._native.edit(self._text(edit))
        return self

    def _bounded(self) -> _Lattice:
        if self._native is None:
            raise ValueError("bounds: the lattice has none of its own, so that it is known with its object only")
        return self._native

    @property
    def control_points(self) -> Floats:
        """Control points, of shape (nx, ny, nz, 3): a view, so that changing it edits the lattice."""
        return self._bounded().numbers[..., :3]

    @control_points.setter
    def control_points(self, value: Any) -> None:
        self.control_points[...] = value

    @property
    def weights(self) -> Floats:
        """Weights above 0, of shape (nx, ny, nz): a view. Unequal ones make the volume rational."""
        return self._bounded().numbers[..., 3]

    @weights.setter
    def weights(self, value: Any) -> None:
        self.weights[...] = value

    @property
    def identity(self) -> Lattice:
        """A lattice of the same box, degree and numbers of control points, without edits."""
        settings = {key: value for key, value in self._settings.items() if key != "type"}
        return Lattice(**settings)

    @property
    def bounds(self) -> Floats | None:
        """Least and greatest corner of the box, of shape (2, 3)."""
        box = self._settings["bounds"]
        return None if box is None else np.array(box)

    def copy(self) -> Lattice:
        """A lattice with the same control points, which is edited by itself."""
        other = self.identity
        other._edits = [*self._edits]
        if self._native is not None:
            other._bounded().numbers[...] = self._native.numbers
        return other

    def __repr__(self) -> str:
        return f"Lattice(degree={self._settings['degree']}, points={self._settings['points']}, bounds={self._settings['bounds']})"

    def twist(self, axis: str, angle: float) -> Lattice:
        """Turns the control points about the box's centre line: by `angle` degrees at the far end, by none at the near end."""
        return self._edited({"twist": {"axis": axis, "angle": angle}})

    def taper(self, axis: str, scale: float | Sequence[float]) -> Lattice:
        """Scales the control points across the box's centre line: by `scale` at the far end, by 1 at the near end."""
        return self._edited({"taper": {"axis": axis, "scale": scale}})

    def bend(self, axis: str, angle: float, toward: str) -> Lattice:
        """Bends the box's centre line to an arc of `angle` degrees, to the side `toward`, such as "x" or "-x"."""
        return self._edited({"bend": {"axis": axis, "angle": angle, "toward": toward}})

    def bulge(self, axis: str, amount: float) -> Lattice:
        """Scales the distance from the box's centre line by 1 + amount sin(π z), with z from 0 to 1 along the axis."""
        return self._edited({"bulge": {"axis": axis, "amount": amount}})

    def move(self, index: Sequence[int], *, by: Any = None, to: Any = None) -> Lattice:
        """Moves the control point of an index by a displacement or to a place."""
        return self._edited({"move": index, "by": by, "to": to})

    def drag(
        self,
        sources: Any,
        targets: Any,
        *,
        using: str = "points",
        min_weight: float | None = None,
        least_squares: bool = False,
    ) -> Drag | None:
        """Moves points to targets by the least change of the lattice (Hu et al. 2001).

        Parameters
        ----------
        sources : array_like of shape (..., 3)
            Points of the undeformed space, inside the box.
        targets : array_like of shape (..., 3)
            Where each must go.
        using : {"points", "weights"}
            What of the lattice changes.
        min_weight : float, optional
            With "weights": the least weight, in parts of the least one before.
        least_squares : bool
            Whether targets that contradict each other are met as nearly as possible.

        Returns
        -------
        Drag or None
            None where the lattice has no bounds, and the drag is done with its object.

        Raises
        ------
        InputError
            If the points cannot all go where they must.
        """
        edit: dict[str, Any] = {"drag": rows("sources", sources, 3)[0], "to": rows("targets", targets, 3)[0]}
        edit |= {"using": using, "min_weight": min_weight}
        if self._native is None:
            self._edits.append(edit)
            return None
        return Drag(*self._native.edit(self._text(edit), least_squares)[0])

    def __call__(self, points: Any) -> Floats:
        """Where points go.

        Parameters
        ----------
        points : array_like of shape (..., 3)

        Returns
        -------
        array of shape (..., 3)
            Points outside the box as they are.

        Raises
        ------
        ValueError
            If `outside` is "error" and a point is outside.
        """
        places, shape = rows("points", points, 3)
        self._check_inside(places)
        return self._bounded().evaluate(places).reshape(*shape, 3)

    def jacobian(self, points: Any) -> Floats:
        """The partials of the map: of shape (..., 3, 3), the component by row, the coordinate that it is derived by, by column."""
        places, shape = rows("points", points, 3)
        self._check_inside(places)
        return self._bounded().jacobian(places).reshape(*shape, 3, 3)

    def contains(self, points: Any) -> NDArray[np.bool_]:
        """Which points of shape (..., 3) the box holds."""
        places, shape = rows("points", points, 3)
        return self._bounded().contains(places).reshape(shape)

    def derivatives(self, points: Any) -> tuple[NDArray[np.int64], Floats]:
        """How the places of points depend on the control points.

        Parameters
        ----------
        points : array_like of shape (..., 3)

        Returns
        -------
        indices : integers of shape (..., M)
            Places of control points in `control_points.reshape(-1, 3)`; M is the product of the degrees + 1.
        weights : array of shape (..., M)
            The derivative of the point's place by such a control point is the weight times the 3 × 3 identity. Weights of a point
            sum to 1; of one outside the box they are 0.
        """
        places, shape = rows("points", points, 3)
        indices, weights = self._bounded().derivatives(places)
        return indices.reshape(*shape, -1), weights.reshape(*shape, -1)

    def _check_inside(self, points: Floats) -> None:
        if self._settings["outside"] == "error":
            outside = np.flatnonzero(~self._bounded().contains(points))
            if outside.size:
                raise ValueError(f"points: {outside.size} are outside the lattice's box, the first in row {outside[0]}")
