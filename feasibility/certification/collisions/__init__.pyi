from .collision_replay import CollisionFault as CollisionFault
from .collision_replay import CollisionReplay as CollisionReplay
from .collision_replay import collision_replay as collision_replay
