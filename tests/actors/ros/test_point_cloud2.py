"""Point clouds to NumPy arrays and back."""

from __future__ import annotations

import builtins
import importlib
import math
import sys
from array import array
from typing import Any

import numpy as np
import pytest

from actors.interfaces.sensor_msgs.msg import PointCloud2, PointField
from actors.interfaces.std_msgs.msg import Header
from actors.ros.sensor_msgs_py import numpy_compat
from actors.ros.sensor_msgs_py.point_cloud2 import (
    create_cloud,
    create_cloud_xyz32,
    dtype_from_fields,
    read_points,
    read_points_list,
    read_points_numpy,
)

POINTS = [(0.0, 1.0, 2.0), (3.0, math.nan, 5.0), (6.0, 7.0, 8.0), (9.0, 10.0, 11.0)]
MIXED = [
    PointField(name="x", offset=0, datatype=PointField.FLOAT32, count=1),
    PointField(name="ring", offset=6, datatype=PointField.UINT16, count=1),
]


def cloud(points: Any = POINTS) -> PointCloud2:
    """Return a cloud of points with x, y and z."""
    return create_cloud_xyz32(Header(frame_id="lidar"), points)


def test_a_cloud_has_the_points_it_was_made_of() -> None:
    """As a structured array, a plain one, and named tuples."""
    made = cloud()
    assert (made.header.frame_id, made.width, made.height, made.point_step, made.row_step) == (
        "lidar", 4, 1, 12, 48
    )  # fmt: skip
    assert isinstance(made.data, array)
    assert made.is_bigendian == (sys.byteorder == "big")
    points = read_points(made)
    assert points.dtype.names == ("x", "y", "z")
    assert points["z"].tolist() == [2.0, 5.0, 8.0, 11.0]
    assert np.array_equal(read_points_numpy(made), np.array(POINTS, "float32"), equal_nan=True)
    assert read_points_list(made)[0]._asdict() == {"x": 0.0, "y": 1.0, "z": 2.0}


def test_points_are_selected() -> None:
    """By field, by number, and without those that have a NaN."""
    made = cloud()
    assert read_points_list(made, ["z", "x"])[3] == (11.0, 9.0)
    assert read_points(made, skip_nans=True)["x"].tolist() == [0.0, 6.0, 9.0]
    assert read_points(made, uvs=[3, 0])["x"].tolist() == [9.0, 0.0]
    assert read_points(made, uvs=np.array([2]))["x"].tolist() == [6.0]
    made.is_dense = True
    assert len(read_points(made, skip_nans=True)) == 4


def test_an_organized_cloud_has_rows() -> None:
    """An array of two dimensions makes them; reading gives it back on request."""
    points = np.arange(18, dtype="float32").reshape(2, 3, 3)
    made = cloud(points)
    assert (made.width, made.height) == (2, 3)
    assert read_points(made).shape == (6,)
    assert np.array_equal(read_points_numpy(made, reshape_organized_cloud=True), points)


def test_fields_have_types_and_places() -> None:
    """With gaps, several elements, no name, and a size for the whole point."""
    several = PointField(name="p", offset=4, datatype=PointField.INT16, count=2)
    dtype = dtype_from_fields([several, PointField(offset=0, datatype=PointField.UINT8, count=1)], 16)
    assert dtype.names == ("p_0", "p_1", "unnamed_field_1")
    assert dtype.itemsize == 16
    made = create_cloud(Header(), MIXED, [(0.5, 7), (1.5, 8)])
    assert made.point_step == 8
    assert read_points(made)["ring"].tolist() == [7, 8]
    structured = np.array([(0.5, 7)], dtype_from_fields(MIXED, 32))
    assert create_cloud(Header(), MIXED, structured, 32).point_step == 32


def test_a_cloud_of_another_byte_order_is_read() -> None:
    """Its points are in the machine's order."""
    swapped = np.array(POINTS, "float32").byteswap()
    made = cloud()
    made.is_bigendian = not made.is_bigendian
    made.data = swapped.tobytes()
    points = read_points(made)
    assert points["x"].tolist() == [0.0, 3.0, 6.0, 9.0]
    assert points["x"].dtype.isnative


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda: read_points(Header()), "PointCloud2, got Header"),  # type: ignore[arg-type]
        (lambda: read_points(cloud(), ["w"]), "no field 'w'"),
        (lambda: read_points_numpy(create_cloud(Header(), MIXED, [])), "several types"),
        (lambda: create_cloud(Header(), MIXED, np.zeros((2, 2))), "structured"),
        (lambda: create_cloud(Header(), MIXED, np.zeros(2, [("x", "f4")])), "the fields make"),
        (lambda: cloud(np.zeros((1, 1, 1, 3))), "two dimensions"),
        (lambda: dtype_from_fields([PointField(name="x", datatype=PointField.INT8)]), "count of 0"),
        (lambda: dtype_from_fields([MIXED[0], MIXED[0]]), "named 'x'"),
    ],
)
def test_what_does_not_fit_is_an_error(act: Any, message: str) -> None:
    """Whose text says why."""
    with pytest.raises(AssertionError, match=message):
        act()


def test_numpy_is_required(monkeypatch: pytest.MonkeyPatch) -> None:
    """The error says how to get it."""
    importing = builtins.__import__

    def without_numpy(name: str, *args: Any, **kwargs: Any) -> Any:
        if name == "numpy":
            raise ImportError(name)
        return importing(name, *args, **kwargs)

    name = "actors.ros.sensor_msgs_py.point_cloud2"
    monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(builtins, "__import__", without_numpy)
    with pytest.raises(ImportError, match="pip install"):
        importlib.import_module(name)


def test_numpys_own_functions_have_a_place() -> None:
    """Programs import them from there where NumPy is old."""
    structured = numpy_compat.unstructured_to_structured(np.zeros((1, 2)), names=["x", "y"])
    assert numpy_compat.structured_to_unstructured(structured).shape == (1, 2)
