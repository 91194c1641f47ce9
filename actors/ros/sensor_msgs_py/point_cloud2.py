"""Points of `sensor_msgs/msg/PointCloud2` as NumPy arrays, and back."""

from __future__ import annotations

import sys
from array import array
from collections import namedtuple
from typing import TYPE_CHECKING, Any, Final, cast

from actors.interfaces.sensor_msgs.msg import PointCloud2, PointField
from proto.extras import install_command

try:
    import numpy as np
    from numpy.lib import recfunctions
except ImportError as error:
    raise ImportError(f"sensor_msgs_py needs NumPy: {install_command('numpy')}", name="numpy") from error

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actors.interfaces.std_msgs.msg import Header

    Array = np.ndarray[Any, np.dtype[Any]]

DUMMY_FIELD_PREFIX: Final = "unnamed_field"
"""What the name of a field without a name begins with; its index follows."""
_FORMATS: Final = {
    PointField.INT8: "i1",
    PointField.UINT8: "u1",
    PointField.INT16: "i2",
    PointField.UINT16: "u2",
    PointField.INT32: "i4",
    PointField.UINT32: "u4",
    PointField.FLOAT32: "f4",
    PointField.FLOAT64: "f8",
}
_BIG_ENDIAN: Final = sys.byteorder == "big"
_recfunctions: Any = recfunctions


def dtype_from_fields(
    fields: Iterable[PointField], point_step: int | None = None, *, big_endian: bool = _BIG_ENDIAN
) -> np.dtype[Any]:
    """Return the NumPy type of a cloud's points.

    Args:
        fields: The cloud's fields; one of `count` > 1 becomes `name_0`, `name_1`, ….
        point_step: The bytes of a point; None: up to the end of the last field.
        big_endian: The byte order; by default the machine's.

    Raises:
        AssertionError: A field has no elements, or two have one name.
    """
    order = ">" if big_endian else "<"
    members: dict[str, tuple[str, int]] = {}
    for index, field in enumerate(fields):
        element = order + _FORMATS[field.datatype]
        name = field.name or f"{DUMMY_FIELD_PREFIX}_{index}"
        assert field.count > 0, f"Field '{name}' of the point cloud has a count of 0"
        for number in range(field.count):
            member = name if field.count == 1 else f"{name}_{number}"
            assert member not in members, f"Two fields of the point cloud are named '{member}'"
            members[member] = element, field.offset + number * np.dtype(element).itemsize
    layout: Any = {
        "names": list(members),
        "formats": [element for element, _ in members.values()],
        "offsets": [offset for _, offset in members.values()],
    }
    if point_step is not None:
        layout["itemsize"] = point_step
    dtype: np.dtype[Any] = np.dtype(layout)
    return dtype


def read_points(
    cloud: PointCloud2,
    field_names: Iterable[str] | None = None,
    skip_nans: bool = False,
    uvs: Iterable[int] | None = None,
    reshape_organized_cloud: bool = False,
) -> Array:
    """Return the points of a cloud as a structured array, which may share the cloud's memory.

    Args:
        cloud: The cloud.
        field_names: The fields to return; None for all.
        skip_nans: Leave out points with a NaN, unless the cloud is dense.
        uvs: Indices of the points to return, after `skip_nans`; None for all.
        reshape_organized_cloud: Return an array of (width, height) if the cloud has several rows.

    Raises:
        AssertionError: `cloud` is no point cloud, or does not have one of the fields.
    """
    assert isinstance(cloud, PointCloud2), f"Expected a PointCloud2, got {type(cloud).__name__}"
    dtype = dtype_from_fields(cloud.fields, cloud.point_step, big_endian=cloud.is_bigendian)
    count = cloud.width * cloud.height
    points: Array = np.ndarray(shape=(count,), dtype=dtype, buffer=cloud.data)
    if field_names is not None:
        wanted = list(field_names)
        missing = [name for name in wanted if name not in (dtype.names or ())]
        assert not missing, f"The point cloud has no field '{missing[0]}', only {dtype.names}"
        points = points[wanted]
    if cloud.is_bigendian != _BIG_ENDIAN:
        points = points.astype(points.dtype.newbyteorder("="))
    if skip_nans and not cloud.is_dense:
        with_nan = [np.isnan(points[name]) for name in points.dtype.names or ()]
        points = points[~np.logical_or.reduce(with_nan)]
    if uvs is not None:
        points = points[uvs if isinstance(uvs, np.ndarray) else np.fromiter(uvs, int)]
    if reshape_organized_cloud and cloud.height > 1:
        points = points.reshape(cloud.width, cloud.height)
    return points


def read_points_numpy(
    cloud: PointCloud2,
    field_names: Iterable[str] | None = None,
    skip_nans: bool = False,
    uvs: Iterable[int] | None = None,
    reshape_organized_cloud: bool = False,
) -> Array:
    """Return the points of a cloud as a plain array with one column for each field.

    Args:
        cloud: The cloud.
        field_names: As for `read_points`.
        skip_nans: As for `read_points`.
        uvs: As for `read_points`.
        reshape_organized_cloud: As for `read_points`.

    Raises:
        AssertionError: The fields are not all of one type, or as for `read_points`.
    """
    names = None if field_names is None else list(field_names)
    types = {field.datatype for field in cloud.fields if names is None or field.name in names}
    assert len(types) <= 1, "The fields of the point cloud are of several types; use read_points"
    points = read_points(cloud, names, skip_nans, uvs, reshape_organized_cloud)
    plain: Array = _recfunctions.structured_to_unstructured(points)
    return plain


def read_points_list(
    cloud: PointCloud2,
    field_names: Iterable[str] | None = None,
    skip_nans: bool = False,
    uvs: Iterable[int] | None = None,
) -> list[Any]:
    """Return the points of a cloud as named tuples, which is slower than `read_points`.

    Args:
        cloud: The cloud.
        field_names: As for `read_points`.
        skip_nans: As for `read_points`.
        uvs: As for `read_points`.

    Raises:
        AssertionError: As for `read_points`.
    """
    points = read_points(cloud, field_names, skip_nans, uvs)
    point: Any = namedtuple("Point", points.dtype.names or ())  # type: ignore[misc]  # noqa: PYI024 - names vary
    return [point._make(each) for each in points]


def create_cloud(
    header: Header, fields: Iterable[PointField], points: Iterable[Any], point_step: int | None = None
) -> PointCloud2:
    """Return a new cloud.

    Args:
        header: Its header.
        fields: Its fields.
        points: A structured array of the fields' type; or an array with one column for each field, all of one
            type; or any sequence of points. An array of two dimensions (of points) makes several rows.
        point_step: The bytes of a point; None: up to the end of the last field.

    Raises:
        AssertionError: The array does not fit the fields, or has more dimensions.
    """
    fields = list(fields)
    dtype = dtype_from_fields(fields, point_step)
    given: Any = cast("Any", points) if isinstance(points, np.ndarray) else None
    if given is None:
        made: Array = np.array([tuple(point) for point in points], dtype)
    elif given.dtype.names is None:
        assert len({field.datatype for field in fields}) <= 1, (
            "The fields are of several types; give the points as a structured array"
        )
        made = _recfunctions.unstructured_to_structured(given, dtype=dtype)
    else:
        assert given.dtype == dtype, f"The points are of type {given.dtype}, but the fields make {dtype}"
        made = given
    assert made.ndim <= 2, f"Points have at most two dimensions, not {made.ndim}"
    width, height = (*made.shape, 1)[:2]
    data: Any = array("B", made.tobytes())
    return PointCloud2(
        header=header,
        height=height,
        width=width,
        fields=fields,
        is_bigendian=_BIG_ENDIAN,
        point_step=made.dtype.itemsize,
        row_step=made.dtype.itemsize * width,
        data=data,
    )


def create_cloud_xyz32(header: Header, points: Iterable[Any]) -> PointCloud2:
    """Return a new cloud whose points have x, y and z as float32.

    Args:
        header: Its header.
        points: As for `create_cloud`.

    Raises:
        AssertionError: As for `create_cloud`.
    """
    fields = [
        PointField(name=name, offset=4 * index, datatype=PointField.FLOAT32, count=1)
        for index, name in enumerate("xyz")
    ]
    return create_cloud(header, fields, points)
