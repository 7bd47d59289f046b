from .collision_replay import CollisionFault as CollisionFault
from .collision_replay import CollisionReplay as CollisionReplay
from .collision_replay import collision_replay as collision_replay
from .nearest import NearestAlong as NearestAlong
from .nearest import NearPair as NearPair
from .nearest import nearest_along as nearest_along
