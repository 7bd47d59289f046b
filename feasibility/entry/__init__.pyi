from .ends import Ends as Ends
from .ends import ends_of as ends_of
