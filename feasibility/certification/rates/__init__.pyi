from .rate_replay import RateReplay as RateReplay
from .rate_replay import Stop as Stop
from .rate_replay import check_rates as check_rates
from .rate_replay import in_place as in_place
from .rate_replay import replay_rates as replay_rates
from .segment_rates import SegmentRates as SegmentRates
from .segment_rates import fastest_anywhere as fastest_anywhere
from .segment_rates import segment_rates as segment_rates
