"""The types of fields."""

from actors.interfaces.slot_types import AbstractGenericString as AbstractGenericString
from actors.interfaces.slot_types import AbstractNestableType as AbstractNestableType
from actors.interfaces.slot_types import AbstractNestedType as AbstractNestedType
from actors.interfaces.slot_types import AbstractSequence as AbstractSequence
from actors.interfaces.slot_types import AbstractString as AbstractString
from actors.interfaces.slot_types import AbstractType as AbstractType
from actors.interfaces.slot_types import AbstractWString as AbstractWString
from actors.interfaces.slot_types import Array as Array
from actors.interfaces.slot_types import BasicType as BasicType
from actors.interfaces.slot_types import BoundedSequence as BoundedSequence
from actors.interfaces.slot_types import BoundedString as BoundedString
from actors.interfaces.slot_types import BoundedWString as BoundedWString
from actors.interfaces.slot_types import NamespacedType as NamespacedType
from actors.interfaces.slot_types import UnboundedSequence as UnboundedSequence
from actors.interfaces.slot_types import UnboundedString as UnboundedString
from actors.interfaces.slot_types import UnboundedWString as UnboundedWString
