from .diagnosis import UNPROVED as UNPROVED
from .diagnosis import cause_of as cause_of
from .diagnosis import causes_of as causes_of
from .diagnosis import decimals as decimals
from .diagnosis import diagnose as diagnose
from .disconnection import disconnected as disconnected
