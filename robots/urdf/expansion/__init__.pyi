from .xacro_files import expanded as expanded
from .xacro_files import is_xacro as is_xacro
