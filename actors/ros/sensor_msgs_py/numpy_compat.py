"""NumPy's conversions between structured arrays and others, which old NumPys did not have."""

from numpy.lib.recfunctions import structured_to_unstructured as structured_to_unstructured
from numpy.lib.recfunctions import unstructured_to_structured as unstructured_to_structured
