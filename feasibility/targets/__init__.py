"""The task applied to a surface: where tool point, axis and reference direction have to be, along
the curves between cell centres and all over the parts of a surface.
"""
