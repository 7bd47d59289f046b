from .choosing import cell_tiles as cell_tiles
from .tiles import CellTiles as CellTiles
from .tiles import Lines as Lines
from .tiles import TileBounds as TileBounds
from .tiles import Tiles as Tiles
