"""Messages of type_description_interfaces."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.type_description_interfaces.msg._field import Field
    from actors.interfaces.type_description_interfaces.msg._field_type import FieldType
    from actors.interfaces.type_description_interfaces.msg._individual_type_description import (
        IndividualTypeDescription,
    )
    from actors.interfaces.type_description_interfaces.msg._key_value import KeyValue
    from actors.interfaces.type_description_interfaces.msg._type_description import TypeDescription
    from actors.interfaces.type_description_interfaces.msg._type_source import TypeSource

__all__ = [
    "Field",
    "FieldType",
    "IndividualTypeDescription",
    "KeyValue",
    "TypeDescription",
    "TypeSource",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "Field": "_field",
            "FieldType": "_field_type",
            "IndividualTypeDescription": "_individual_type_description",
            "KeyValue": "_key_value",
            "TypeDescription": "_type_description",
            "TypeSource": "_type_source",
        },
    )
