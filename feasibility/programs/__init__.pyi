from .controllers import ProgramError as ProgramError
from .controllers import check_program as check_program
from .controllers import language_of as language_of
from .writing import program_text as program_text
from .writing import save_program as save_program
