"""Messages of sensor_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.sensor_msgs.msg._battery_state import BatteryState
    from actors.interfaces.sensor_msgs.msg._camera_info import CameraInfo
    from actors.interfaces.sensor_msgs.msg._channel_float32 import ChannelFloat32
    from actors.interfaces.sensor_msgs.msg._compressed_image import CompressedImage
    from actors.interfaces.sensor_msgs.msg._fluid_pressure import FluidPressure
    from actors.interfaces.sensor_msgs.msg._illuminance import Illuminance
    from actors.interfaces.sensor_msgs.msg._image import Image
    from actors.interfaces.sensor_msgs.msg._imu import Imu
    from actors.interfaces.sensor_msgs.msg._joint_state import JointState
    from actors.interfaces.sensor_msgs.msg._joy import Joy
    from actors.interfaces.sensor_msgs.msg._joy_feedback import JoyFeedback
    from actors.interfaces.sensor_msgs.msg._joy_feedback_array import JoyFeedbackArray
    from actors.interfaces.sensor_msgs.msg._laser_echo import LaserEcho
    from actors.interfaces.sensor_msgs.msg._laser_scan import LaserScan
    from actors.interfaces.sensor_msgs.msg._magnetic_field import MagneticField
    from actors.interfaces.sensor_msgs.msg._multi_dof_joint_state import MultiDOFJointState
    from actors.interfaces.sensor_msgs.msg._multi_echo_laser_scan import MultiEchoLaserScan
    from actors.interfaces.sensor_msgs.msg._nav_sat_fix import NavSatFix
    from actors.interfaces.sensor_msgs.msg._nav_sat_status import NavSatStatus
    from actors.interfaces.sensor_msgs.msg._point_cloud import PointCloud
    from actors.interfaces.sensor_msgs.msg._point_cloud2 import PointCloud2
    from actors.interfaces.sensor_msgs.msg._point_field import PointField
    from actors.interfaces.sensor_msgs.msg._range import Range
    from actors.interfaces.sensor_msgs.msg._region_of_interest import RegionOfInterest
    from actors.interfaces.sensor_msgs.msg._relative_humidity import RelativeHumidity
    from actors.interfaces.sensor_msgs.msg._temperature import Temperature
    from actors.interfaces.sensor_msgs.msg._time_reference import TimeReference

__all__ = [
    "BatteryState",
    "CameraInfo",
    "ChannelFloat32",
    "CompressedImage",
    "FluidPressure",
    "Illuminance",
    "Image",
    "Imu",
    "JointState",
    "Joy",
    "JoyFeedback",
    "JoyFeedbackArray",
    "LaserEcho",
    "LaserScan",
    "MagneticField",
    "MultiDOFJointState",
    "MultiEchoLaserScan",
    "NavSatFix",
    "NavSatStatus",
    "PointCloud",
    "PointCloud2",
    "PointField",
    "Range",
    "RegionOfInterest",
    "RelativeHumidity",
    "Temperature",
    "TimeReference",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "BatteryState": "_battery_state",
            "CameraInfo": "_camera_info",
            "ChannelFloat32": "_channel_float32",
            "CompressedImage": "_compressed_image",
            "FluidPressure": "_fluid_pressure",
            "Illuminance": "_illuminance",
            "Image": "_image",
            "Imu": "_imu",
            "JointState": "_joint_state",
            "Joy": "_joy",
            "JoyFeedback": "_joy_feedback",
            "JoyFeedbackArray": "_joy_feedback_array",
            "LaserEcho": "_laser_echo",
            "LaserScan": "_laser_scan",
            "MagneticField": "_magnetic_field",
            "MultiDOFJointState": "_multi_dof_joint_state",
            "MultiEchoLaserScan": "_multi_echo_laser_scan",
            "NavSatFix": "_nav_sat_fix",
            "NavSatStatus": "_nav_sat_status",
            "PointCloud": "_point_cloud",
            "PointCloud2": "_point_cloud2",
            "PointField": "_point_field",
            "Range": "_range",
            "RegionOfInterest": "_region_of_interest",
            "RelativeHumidity": "_relative_humidity",
            "Temperature": "_temperature",
            "TimeReference": "_time_reference",
        },
    )
