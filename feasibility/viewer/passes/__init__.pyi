from .pass_view import view_passes as view_passes
