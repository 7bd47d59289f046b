from .faces_view import faces_page as faces_page
