"""Messages of example_interfaces."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.example_interfaces.msg._bool import Bool
    from actors.interfaces.example_interfaces.msg._byte import Byte
    from actors.interfaces.example_interfaces.msg._byte_multi_array import ByteMultiArray
    from actors.interfaces.example_interfaces.msg._char import Char
    from actors.interfaces.example_interfaces.msg._empty import Empty
    from actors.interfaces.example_interfaces.msg._float32 import Float32
    from actors.interfaces.example_interfaces.msg._float32_multi_array import Float32MultiArray
    from actors.interfaces.example_interfaces.msg._float64 import Float64
    from actors.interfaces.example_interfaces.msg._float64_multi_array import Float64MultiArray
    from actors.interfaces.example_interfaces.msg._int8 import Int8
    from actors.interfaces.example_interfaces.msg._int8_multi_array import Int8MultiArray
    from actors.interfaces.example_interfaces.msg._int16 import Int16
    from actors.interfaces.example_interfaces.msg._int16_multi_array import Int16MultiArray
    from actors.interfaces.example_interfaces.msg._int32 import Int32
    from actors.interfaces.example_interfaces.msg._int32_multi_array import Int32MultiArray
    from actors.interfaces.example_interfaces.msg._int64 import Int64
    from actors.interfaces.example_interfaces.msg._int64_multi_array import Int64MultiArray
    from actors.interfaces.example_interfaces.msg._multi_array_dimension import MultiArrayDimension
    from actors.interfaces.example_interfaces.msg._multi_array_layout import MultiArrayLayout
    from actors.interfaces.example_interfaces.msg._string import String
    from actors.interfaces.example_interfaces.msg._u_int8 import UInt8
    from actors.interfaces.example_interfaces.msg._u_int8_multi_array import UInt8MultiArray
    from actors.interfaces.example_interfaces.msg._u_int16 import UInt16
    from actors.interfaces.example_interfaces.msg._u_int16_multi_array import UInt16MultiArray
    from actors.interfaces.example_interfaces.msg._u_int32 import UInt32
    from actors.interfaces.example_interfaces.msg._u_int32_multi_array import UInt32MultiArray
    from actors.interfaces.example_interfaces.msg._u_int64 import UInt64
    from actors.interfaces.example_interfaces.msg._u_int64_multi_array import UInt64MultiArray
    from actors.interfaces.example_interfaces.msg._w_string import WString

__all__ = [
    "Bool",
    "Byte",
    "ByteMultiArray",
    "Char",
    "Empty",
    "Float32",
    "Float32MultiArray",
    "Float64",
    "Float64MultiArray",
    "Int8",
    "Int8MultiArray",
    "Int16",
    "Int16MultiArray",
    "Int32",
    "Int32MultiArray",
    "Int64",
    "Int64MultiArray",
    "MultiArrayDimension",
    "MultiArrayLayout",
    "String",
    "UInt8",
    "UInt8MultiArray",
    "UInt16",
    "UInt16MultiArray",
    "UInt32",
    "UInt32MultiArray",
    "UInt64",
    "UInt64MultiArray",
    "WString",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "Bool": "_bool",
            "Byte": "_byte",
            "ByteMultiArray": "_byte_multi_array",
            "Char": "_char",
            "Empty": "_empty",
            "Float32": "_float32",
            "Float32MultiArray": "_float32_multi_array",
            "Float64": "_float64",
            "Float64MultiArray": "_float64_multi_array",
            "Int16": "_int16",
            "Int16MultiArray": "_int16_multi_array",
            "Int32": "_int32",
            "Int32MultiArray": "_int32_multi_array",
            "Int64": "_int64",
            "Int64MultiArray": "_int64_multi_array",
            "Int8": "_int8",
            "Int8MultiArray": "_int8_multi_array",
            "MultiArrayDimension": "_multi_array_dimension",
            "MultiArrayLayout": "_multi_array_layout",
            "String": "_string",
            "UInt16": "_u_int16",
            "UInt16MultiArray": "_u_int16_multi_array",
            "UInt32": "_u_int32",
            "UInt32MultiArray": "_u_int32_multi_array",
            "UInt64": "_u_int64",
            "UInt64MultiArray": "_u_int64_multi_array",
            "UInt8": "_u_int8",
            "UInt8MultiArray": "_u_int8_multi_array",
            "WString": "_w_string",
        },
    )
