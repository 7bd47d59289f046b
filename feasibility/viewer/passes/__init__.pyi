from .digits import digit_lines as digit_lines
from .pass_view import view_passes as view_passes
