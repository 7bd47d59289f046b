from .axes import ProgramError as ProgramError
from .axes import ProgramSettings as ProgramSettings
from .axes import check_program as check_program
from .controllers import language_of as language_of
from .header import frame_words as frame_words
from .working import working_places as working_places
from .working import working_times as working_times
from .writing import save_program as save_program
