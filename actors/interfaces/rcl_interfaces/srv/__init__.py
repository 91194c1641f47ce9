"""Services of rcl_interfaces."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.rcl_interfaces.srv._describe_parameters import DescribeParameters
    from actors.interfaces.rcl_interfaces.srv._get_logger_levels import GetLoggerLevels
    from actors.interfaces.rcl_interfaces.srv._get_parameter_types import GetParameterTypes
    from actors.interfaces.rcl_interfaces.srv._get_parameters import GetParameters
    from actors.interfaces.rcl_interfaces.srv._list_parameters import ListParameters
    from actors.interfaces.rcl_interfaces.srv._set_logger_levels import SetLoggerLevels
    from actors.interfaces.rcl_interfaces.srv._set_parameters import SetParameters
    from actors.interfaces.rcl_interfaces.srv._set_parameters_atomically import SetParametersAtomically

__all__ = [
    "DescribeParameters",
    "GetLoggerLevels",
    "GetParameterTypes",
    "GetParameters",
    "ListParameters",
    "SetLoggerLevels",
    "SetParameters",
    "SetParametersAtomically",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "DescribeParameters": "_describe_parameters",
            "GetLoggerLevels": "_get_logger_levels",
            "GetParameterTypes": "_get_parameter_types",
            "GetParameters": "_get_parameters",
            "ListParameters": "_list_parameters",
            "SetLoggerLevels": "_set_logger_levels",
            "SetParameters": "_set_parameters",
            "SetParametersAtomically": "_set_parameters_atomically",
        },
    )
