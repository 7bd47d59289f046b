from .step_process import Caps as Caps
from .step_surface import StepFace as StepFace
from .step_surface import checked_choice as checked_choice
from .step_surface import step as step
from .step_surface import step_faces as step_faces
from .step_surface import step_triangles as step_triangles
