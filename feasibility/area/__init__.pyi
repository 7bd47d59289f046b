from .certified_area import CertifiedArea as CertifiedArea
from .certified_area import area_from as area_from
from .certified_area import certified_area as certified_area
from .certified_area import why_no_area as why_no_area
