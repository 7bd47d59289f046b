from .certified import certified_layer as certified_layer
from .certified import with_certified_share as with_certified_share
