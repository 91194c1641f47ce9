"""Messages of rcl_interfaces."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.rcl_interfaces.msg._floating_point_range import FloatingPointRange
    from actors.interfaces.rcl_interfaces.msg._integer_range import IntegerRange
    from actors.interfaces.rcl_interfaces.msg._list_parameters_result import ListParametersResult
    from actors.interfaces.rcl_interfaces.msg._log import Log
    from actors.interfaces.rcl_interfaces.msg._logger_level import LoggerLevel
    from actors.interfaces.rcl_interfaces.msg._parameter import Parameter
    from actors.interfaces.rcl_interfaces.msg._parameter_descriptor import ParameterDescriptor
    from actors.interfaces.rcl_interfaces.msg._parameter_event import ParameterEvent
    from actors.interfaces.rcl_interfaces.msg._parameter_event_descriptors import ParameterEventDescriptors
    from actors.interfaces.rcl_interfaces.msg._parameter_type import ParameterType
    from actors.interfaces.rcl_interfaces.msg._parameter_value import ParameterValue
    from actors.interfaces.rcl_interfaces.msg._set_logger_levels_result import SetLoggerLevelsResult
    from actors.interfaces.rcl_interfaces.msg._set_parameters_result import SetParametersResult

__all__ = [
    "FloatingPointRange",
    "IntegerRange",
    "ListParametersResult",
    "Log",
    "LoggerLevel",
    "Parameter",
    "ParameterDescriptor",
    "ParameterEvent",
    "ParameterEventDescriptors",
    "ParameterType",
    "ParameterValue",
    "SetLoggerLevelsResult",
    "SetParametersResult",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "FloatingPointRange": "_floating_point_range",
            "IntegerRange": "_integer_range",
            "ListParametersResult": "_list_parameters_result",
            "Log": "_log",
            "LoggerLevel": "_logger_level",
            "Parameter": "_parameter",
            "ParameterDescriptor": "_parameter_descriptor",
            "ParameterEvent": "_parameter_event",
            "ParameterEventDescriptors": "_parameter_event_descriptors",
            "ParameterType": "_parameter_type",
            "ParameterValue": "_parameter_value",
            "SetLoggerLevelsResult": "_set_logger_levels_result",
            "SetParametersResult": "_set_parameters_result",
        },
    )
