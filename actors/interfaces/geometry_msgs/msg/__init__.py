"""Messages of geometry_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.geometry_msgs.msg._accel import Accel
    from actors.interfaces.geometry_msgs.msg._accel_stamped import AccelStamped
    from actors.interfaces.geometry_msgs.msg._accel_with_covariance import AccelWithCovariance
    from actors.interfaces.geometry_msgs.msg._accel_with_covariance_stamped import AccelWithCovarianceStamped
    from actors.interfaces.geometry_msgs.msg._inertia import Inertia
    from actors.interfaces.geometry_msgs.msg._inertia_stamped import InertiaStamped
    from actors.interfaces.geometry_msgs.msg._point import Point
    from actors.interfaces.geometry_msgs.msg._point32 import Point32
    from actors.interfaces.geometry_msgs.msg._point_stamped import PointStamped
    from actors.interfaces.geometry_msgs.msg._polygon import Polygon
    from actors.interfaces.geometry_msgs.msg._polygon_instance import PolygonInstance
    from actors.interfaces.geometry_msgs.msg._polygon_instance_stamped import PolygonInstanceStamped
    from actors.interfaces.geometry_msgs.msg._polygon_stamped import PolygonStamped
    from actors.interfaces.geometry_msgs.msg._pose import Pose
    from actors.interfaces.geometry_msgs.msg._pose2_d import Pose2D
    from actors.interfaces.geometry_msgs.msg._pose_array import PoseArray
    from actors.interfaces.geometry_msgs.msg._pose_stamped import PoseStamped
    from actors.interfaces.geometry_msgs.msg._pose_with_covariance import PoseWithCovariance
    from actors.interfaces.geometry_msgs.msg._pose_with_covariance_stamped import PoseWithCovarianceStamped
    from actors.interfaces.geometry_msgs.msg._quaternion import Quaternion
    from actors.interfaces.geometry_msgs.msg._quaternion_stamped import QuaternionStamped
    from actors.interfaces.geometry_msgs.msg._transform import Transform
    from actors.interfaces.geometry_msgs.msg._transform_stamped import TransformStamped
    from actors.interfaces.geometry_msgs.msg._twist import Twist
    from actors.interfaces.geometry_msgs.msg._twist_stamped import TwistStamped
    from actors.interfaces.geometry_msgs.msg._twist_with_covariance import TwistWithCovariance
    from actors.interfaces.geometry_msgs.msg._twist_with_covariance_stamped import TwistWithCovarianceStamped
    from actors.interfaces.geometry_msgs.msg._vector3 import Vector3
    from actors.interfaces.geometry_msgs.msg._vector3_stamped import Vector3Stamped
    from actors.interfaces.geometry_msgs.msg._velocity_stamped import VelocityStamped
    from actors.interfaces.geometry_msgs.msg._wrench import Wrench
    from actors.interfaces.geometry_msgs.msg._wrench_stamped import WrenchStamped

__all__ = [
    "Accel",
    "AccelStamped",
    "AccelWithCovariance",
    "AccelWithCovarianceStamped",
    "Inertia",
    "InertiaStamped",
    "Point",
    "Point32",
    "PointStamped",
    "Polygon",
    "PolygonInstance",
    "PolygonInstanceStamped",
    "PolygonStamped",
    "Pose",
    "Pose2D",
    "PoseArray",
    "PoseStamped",
    "PoseWithCovariance",
    "PoseWithCovarianceStamped",
    "Quaternion",
    "QuaternionStamped",
    "Transform",
    "TransformStamped",
    "Twist",
    "TwistStamped",
    "TwistWithCovariance",
    "TwistWithCovarianceStamped",
    "Vector3",
    "Vector3Stamped",
    "VelocityStamped",
    "Wrench",
    "WrenchStamped",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "Accel": "_accel",
            "AccelStamped": "_accel_stamped",
            "AccelWithCovariance": "_accel_with_covariance",
            "AccelWithCovarianceStamped": "_accel_with_covariance_stamped",
            "Inertia": "_inertia",
            "InertiaStamped": "_inertia_stamped",
            "Point": "_point",
            "Point32": "_point32",
            "PointStamped": "_point_stamped",
            "Polygon": "_polygon",
            "PolygonInstance": "_polygon_instance",
            "PolygonInstanceStamped": "_polygon_instance_stamped",
            "PolygonStamped": "_polygon_stamped",
            "Pose": "_pose",
            "Pose2D": "_pose2_d",
            "PoseArray": "_pose_array",
            "PoseStamped": "_pose_stamped",
            "PoseWithCovariance": "_pose_with_covariance",
            "PoseWithCovarianceStamped": "_pose_with_covariance_stamped",
            "Quaternion": "_quaternion",
            "QuaternionStamped": "_quaternion_stamped",
            "Transform": "_transform",
            "TransformStamped": "_transform_stamped",
            "Twist": "_twist",
            "TwistStamped": "_twist_stamped",
            "TwistWithCovariance": "_twist_with_covariance",
            "TwistWithCovarianceStamped": "_twist_with_covariance_stamped",
            "Vector3": "_vector3",
            "Vector3Stamped": "_vector3_stamped",
            "VelocityStamped": "_velocity_stamped",
            "Wrench": "_wrench",
            "WrenchStamped": "_wrench_stamped",
        },
    )
