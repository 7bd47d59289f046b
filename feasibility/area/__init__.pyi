from .certified_area import CertifiedArea as CertifiedArea
from .certified_area import area_from as area_from
from .certified_area import certified_area as certified_area
from .certified_area import visited as visited
from .words import area_json as area_json
from .words import area_words as area_words
from .words import measured_area as measured_area
from .words import percent_down as percent_down
